// From descriptions, by the tables of rumo_tables.h.
#ifndef RUMO_BINDING_DESCRIPTION_H
#define RUMO_BINDING_DESCRIPTION_H

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <string>
#include <type_traits>
#include <vector>

#include "arrays.h"

namespace {

// Reads the arrays of a description by the tables, and keeps them alive meanwhile.
class Description {
public:
    explicit Description(nb::dict values) : values_(std::move(values)) {}

    // A problem, or what a guard must know of one.
    template <class T> T read() {
        T read{};
        read.sizes = sizes();
        fill(&read, "", &read.sizes);
        return read;
    }

    rumo_sizes sizes() {
        rumo_sizes sizes{};
#define READ_SIZE(name, least) sizes.name = number(#name, least);
        RUMO_SIZES_TABLE(READ_SIZE)
#undef READ_SIZE
        return sizes;
    }

    // Absent arrays stay NULL.
    rumo_numbers numbers(const rumo_sizes &sizes) {
        rumo_numbers read{};
        optional_ = true;
        fill(&read, "", &sizes);
        return read;
    }

    // What a filter is told of the outputs of a problem of these sizes.
    rumo_filter_data filter(const rumo_sizes &sizes) {
        rumo_filter_data read{};
        fill(&read, "", &sizes);
        return read;
    }

private:
#define READ_COUNT(name, least) t->name = number(prefix + #name, least);
#define READ_INTS(name, rows, columns) t->name = array<int>(prefix + #name, rows, columns);
#define READ_DOUBLES(name, rows, columns, rule) t->name = array<double>(prefix + #name, rows, columns);
#define READ_STRUCT(type, name) fill(&t->name, prefix_of(prefix, #name), s);
#define READ(type, table)                                                          \
    void fill(type *t, const std::string &prefix, const rumo_sizes *s) {           \
        (void)s;                                                                   \
        table(READ_COUNT, READ_INTS, READ_DOUBLES, READ_STRUCT)                    \
    }
    void fill(rumo_sizes *, const std::string &, const rumo_sizes *) {}
    RUMO_TABLES(READ)
#undef READ_COUNT
#undef READ_INTS
#undef READ_DOUBLES
#undef READ_STRUCT
#undef READ

    // Numbers and bounds have names of their own; other parts are told apart by what they belong to.
    static std::string prefix_of(const std::string &prefix, const std::string &name) {
        return name == "numbers" || name == "bounds" ? prefix : prefix + name + "_";
    }

    nb::object value(const std::string &name) const {
        if (!values_.contains(name.c_str())) {
            if (optional_) return nb::none();
            throw nb::value_error((name + ": is missing").c_str());
        }
        return values_[name.c_str()];
    }

    int number(const std::string &name, int least) const {
        const auto number = nb::cast<int>(value(name));
        if (number < least) throw nb::value_error((name + ": expected at least " + std::to_string(least)).c_str());
        return number;
    }

    template <class T> const T *array(const std::string &name, int rows, int columns) {
        using Array = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
        const auto length = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
        const auto given = value(name);
        if (given.is_none() && optional_) return nullptr;
        Array array;
        if (!nb::try_cast<Array>(given, array, false) || array.size() != length) {
            const auto kind = std::is_same_v<T, int> ? " ints (" : " doubles (";
            throw nb::value_error((name + ": expected " + std::to_string(length) + kind + std::to_string(rows) + ", " +
                                   std::to_string(columns) + ")")
                                      .c_str());
        }
        arrays_.push_back(nb::cast(array));
        return array.data();
    }

    nb::dict values_;
    bool optional_ = false;
    std::vector<nb::object> arrays_;
};

// Raises ValueError with the name of what is wrong, as a description has it, and how.
void raise_if(const rumo_fault &fault) {
    if (fault.error == RUMO_FINE) return;
    const std::string part = fault.part;
    const auto own = part.empty() || part == "sizes" || part == "numbers" || part == "bounds";
    const auto name = (own ? "" : part + "_") + fault.member + (fault.index < 0 ? "" : "[" + std::to_string(fault.index) + "]");
    const auto *text = portable_table()->error_text(fault.error);
    throw nb::value_error((name + " " + text).c_str());
}

rumo_settings settings_from(nb::dict d) {
    rumo_settings settings{};
#define READ_COUNT(name, least) settings.name = nb::cast<int>(d[#name]);
#define READ_REAL(name) settings.name = nb::cast<double>(d[#name]);
    RUMO_SETTINGS_TABLE(READ_COUNT, READ_REAL)
#undef READ_COUNT
#undef READ_REAL
    raise_if(portable_table()->check_settings(&settings));
    return settings;
}

// Members of each struct as (name, kind, rows, columns, rule); rows and columns as C.
nb::dict tables() {
    nb::dict all;
    nb::list members;
#define ROW_COUNT(name, least) members.append(nb::make_tuple(#name, "count", "1", "1", std::to_string(least)));
#define ROW_REAL(name) members.append(nb::make_tuple(#name, "real", "1", "1", ""));
#define ROW_INTS(name, rows, columns) members.append(nb::make_tuple(#name, "ints", #rows, #columns, ""));
#define ROW_DOUBLES(name, rows, columns, rule) members.append(nb::make_tuple(#name, "doubles", #rows, #columns, #rule));
#define ROW_STRUCT(type, name) members.append(nb::make_tuple(#name, #type, "1", "1", ""));
#define ROWS(type, table)                                  \
    members = nb::list();                                  \
    table(ROW_COUNT, ROW_INTS, ROW_DOUBLES, ROW_STRUCT) \
    all[#type] = members;
    RUMO_TABLES(ROWS)
    members = nb::list();
    RUMO_SIZES_TABLE(ROW_COUNT)
    all["rumo_sizes"] = members;
    members = nb::list();
    RUMO_SETTINGS_TABLE(ROW_COUNT, ROW_REAL)
    all["rumo_settings"] = members;
#undef ROW_COUNT
#undef ROW_REAL
#undef ROW_INTS
#undef ROW_DOUBLES
#undef ROW_STRUCT
#undef ROWS
    return all;
}

} // namespace

#endif
