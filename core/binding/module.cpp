// The core for Python: arrays in, arrays out. The interpreter lock is released while the core works.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "rumo_core.h"

extern "C" {
extern const rumo_api rumo_core_baseline;
#ifdef RUMO_X86_VARIANTS
extern const rumo_api rumo_core_v3;
extern const rumo_api rumo_core_v4;
#endif
}

namespace nb = nanobind;
using namespace nb::literals;

namespace {

// The fastest table of this build that the processor can run.
const rumo_api *portable_table() {
#ifdef RUMO_X86_VARIANTS
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))
        return &rumo_core_v4;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return &rumo_core_v3;
#endif
    return &rumo_core_baseline;
}

const rumo_api *table_at(std::uintptr_t address) {
    const auto *table = address ? reinterpret_cast<const rumo_api *>(address) : portable_table();
    if (table->version != RUMO_CORE_VERSION) throw nb::value_error("the tailored build belongs to another version");
    return table;
}

// Contiguous doubles of a given length, without a copy where the argument already is that.
class Vector {
public:
    Vector(nb::handle object, std::size_t length, const char *name, std::size_t last = 0) {
        if (PyObject_GetBuffer(object.ptr(), &view_, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0) nb::raise_python_error();
        const bool doubles = view_.format && std::strcmp(view_.format, "d") == 0;
        const bool shaped = last == 0 || (view_.ndim > 0 && static_cast<std::size_t>(view_.shape[view_.ndim - 1]) == last);
        if (!doubles || !shaped || static_cast<std::size_t>(view_.len) != length * sizeof(double)) {
            PyBuffer_Release(&view_);
            throw nb::value_error((std::string(name) + ": expected " + std::to_string(length) + " doubles").c_str());
        }
    }
    ~Vector() { PyBuffer_Release(&view_); }
    Vector(const Vector &) = delete;
    Vector &operator=(const Vector &) = delete;
    const double *data() const { return static_cast<const double *>(view_.buf); }
    double *writable() const { return static_cast<double *>(view_.buf); }

private:
    Py_buffer view_{};
};

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

rumo_settings settings_from(nb::dict d) {
    rumo_settings settings{};
#define READ_COUNT(name, least) settings.name = nb::cast<int>(d[#name]);
#define READ_REAL(name) settings.name = nb::cast<double>(d[#name]);
    RUMO_SETTINGS_TABLE(READ_COUNT, READ_REAL)
#undef READ_COUNT
#undef READ_REAL
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

class Controller {
public:
    Controller(std::uintptr_t table, nb::dict description, nb::dict settings) : api_(table_at(table)) {
        Description d(description);
        const auto problem = d.read<rumo_problem>();
        const rumo_settings chosen = settings_from(settings);
        sizes_ = problem.sizes;
        memory_ = std::make_unique<unsigned char[]>(api_->size(&problem));
        core_ = api_->create(&problem, &chosen, memory_.get());
        const auto &s = sizes_;
        count_ = static_cast<std::size_t>(s.horizon * s.inputs + (s.horizon + 1) * s.states +
                                          s.horizon * (s.constraints + s.algebraic) + RUMO_DIAGNOSTIC_COUNT);
    }

    void configure(nb::dict settings) {
        const rumo_settings chosen = settings_from(settings);
        Lock lock(*this);
        api_->configure(core_, &chosen);
    }

    void reset() {
        Lock lock(*this);
        api_->reset(core_);
        ready_ = false;
    }

    void start(nb::handle x) {
        const Vector state(x, states(), "x");
        Lock lock(*this);
        api_->start(core_, state.data());
        ready_ = false;
    }

    void set_applied(nb::handle inputs) {
        const Vector values(inputs, decided(), "applied");
        Lock lock(*this);
        std::copy_n(values.data(), decided(), api_->applied(core_));
    }

    void set_parameters(nb::handle parameters) {
        const Vector values(parameters, static_cast<std::size_t>(sizes_.horizon * sizes_.parameters), "parameters");
        Lock lock(*this);
        api_->set_parameters(core_, values.data());
        ready_ = false;
    }

    void get_applied(nb::handle inputs) {
        const Vector values(inputs, decided(), "applied");
        Lock lock(*this);
        std::copy_n(api_->applied(core_), decided(), values.writable());
    }

    std::vector<long long> counts() {
        Lock lock(*this);
        const long long *counts = api_->counts(core_);
        return std::vector<long long>(counts, counts + RUMO_STATUS_COUNT);
    }

    void prepare() {
        Lock lock(*this);
        api_->prepare(core_);
        ready_ = true;
    }

    bool ready() const { return ready_; }

    // Both write the plan's numbers into an array; (status, cause, prepare, feedback, iterations, conflict or None).
    nb::tuple feedback(nb::handle x, nb::handle reference, nb::handle numbers) {
        return run(api_->feedback, x, reference, numbers);
    }

    nb::tuple step(nb::handle x, nb::handle reference, nb::handle numbers) {
        return run(api_->step, x, reference, numbers);
    }

    // Runs recorded measurements (steps, nx) and references (steps, N + 1, ny); times (steps, 3) [s] of
    // linearisation, of the preparation that it belongs to, and of feedback.
    void replay(nb::handle x, nb::handle reference, nb::handle applied, nb::handle times, int steps) {
        const auto count = static_cast<std::size_t>(steps);
        const Vector states_in(x, count * states(), "x"), wanted(reference, count * window(), "reference");
        const Vector decided_in(applied, count * decided(), "applied"), out(times, 3 * count, "times");
        Lock lock(*this);
        nb::gil_scoped_release release;
        rumo_plan plan;
        for (std::size_t i = 0; i < count; ++i) {
            std::copy_n(decided_in.data() + i * decided(), decided(), api_->applied(core_));
            api_->step(core_, states_in.data() + i * states(), wanted.data() + i * window(), &plan);
            out.writable()[3 * i] = plan.linearize_seconds;
            out.writable()[3 * i + 1] = plan.prepare_seconds;
            out.writable()[3 * i + 2] = plan.feedback_seconds;
        }
        ready_ = false;
    }

private:
    // Two threads may not be in one controller; waiting for the other must not hold the interpreter.
    struct Lock {
        explicit Lock(Controller &c) : lock_(c.mutex_, std::defer_lock) {
            if (!lock_.try_lock()) {
                nb::gil_scoped_release release;
                lock_.lock();
            }
        }
        std::unique_lock<std::mutex> lock_;
    };

    std::size_t states() const { return static_cast<std::size_t>(sizes_.states); }
    std::size_t decided() const { return static_cast<std::size_t>(std::max(sizes_.delay, 1) * sizes_.inputs); }
    std::size_t window() const { return static_cast<std::size_t>((sizes_.horizon + 1) * sizes_.outputs); }

    nb::tuple run(void (*function)(rumo_controller *, const double *, const double *, rumo_plan *), nb::handle x,
                  nb::handle reference, nb::handle numbers) {
        const Vector state(x, states(), "x", states()), out(numbers, count_, "numbers");
        const Vector wanted(reference, window(), "reference", static_cast<std::size_t>(sizes_.outputs));
        rumo_plan plan;
        std::vector<int> rows; // copied while the controller is ours: another thread's step would overwrite them
        {
            Lock lock(*this);
            nb::gil_scoped_release release;
            function(core_, state.data(), wanted.data(), &plan);
            std::copy_n(plan.numbers, count_, out.writable());
            if (plan.conflicts > 0) rows.assign(plan.conflict, plan.conflict + plan.conflicts);
            ready_ = false;
        }
        nb::object conflict = nb::none();
        if (!rows.empty()) conflict = nb::cast(rows);
        return nb::make_tuple(static_cast<int>(plan.status), static_cast<int>(plan.cause), plan.prepare_seconds,
                              plan.feedback_seconds, plan.iterations, conflict);
    }

    const rumo_api *api_;
    rumo_sizes sizes_{};
    std::unique_ptr<unsigned char[]> memory_;
    rumo_controller *core_ = nullptr;
    std::size_t count_ = 0;
    std::mutex mutex_;
    bool ready_ = false;
};

// The QP solver by itself; keeps its working set from one call to the next.
class Qp {
public:
    Qp(int variables, int rows) : api_(portable_table()), variables_(variables), rows_(rows) {
        memory_ = std::make_unique<unsigned char[]>(api_->qp_size(variables, rows));
    }

    nb::tuple solve(nb::handle hessian, nb::handle gradient, nb::handle lower, nb::handle upper, nb::handle matrix,
                    nb::handle row_lower, nb::handle row_upper, nb::handle l1, nb::handle l2, nb::dict settings,
                    bool warm, nb::handle v, nb::handle multipliers) {
        const auto n = static_cast<std::size_t>(variables_), m = static_cast<std::size_t>(rows_);
        const Vector H(hessian, n * n, "hessian"), g(gradient, n, "gradient"), lb(lower, n, "lower"), ub(upper, n, "upper"),
            A(matrix, m * n, "matrix"), lo(row_lower, m, "row_lower"), up(row_upper, m, "row_upper"), p1(l1, m, "l1"),
            p2(l2, m, "l2"), out(v, n, "v"), mu(multipliers, n + m, "multipliers");
        const rumo_qp_data data = {variables_, rows_,     H.data(),  g.data(),  lb.data(), ub.data(),
                                   A.data(),   lo.data(), up.data(), p1.data(), p2.data()};
        const rumo_settings chosen = settings_from(settings);
        std::vector<int> conflict(n + m + 1);
        rumo_qp_result result;
        {
            nb::gil_scoped_release release;
            result = api_->qp_solve(&data, &chosen, warm && used_, memory_.get(), out.writable(), mu.writable(),
                                    conflict.data());
        }
        used_ = true;
        conflict.resize(static_cast<std::size_t>(result.conflicts));
        return nb::make_tuple(static_cast<int>(result.status), result.iterations, result.seconds, result.factor_seconds,
                              conflict);
    }

private:
    const rumo_api *api_;
    int variables_, rows_;
    std::unique_ptr<unsigned char[]> memory_;
    bool used_ = false;
};

} // namespace

NB_MODULE(_core, module) {
    module.attr("VERSION") = RUMO_CORE_VERSION;
    module.attr("TABLES") = tables();
    module.def("build", [](std::uintptr_t table) { return std::string(table_at(table)->build); }, "table"_a = 0);
    nb::class_<Controller>(module, "Controller")
        .def(nb::init<std::uintptr_t, nb::dict, nb::dict>(), "table"_a, "description"_a, "settings"_a)
        .def("configure", &Controller::configure)
        .def("reset", &Controller::reset)
        .def("start", &Controller::start)
        .def("set_applied", &Controller::set_applied)
        .def("set_parameters", &Controller::set_parameters)
        .def("get_applied", &Controller::get_applied)
        .def("counts", &Controller::counts)
        .def("prepare", &Controller::prepare)
        .def_prop_ro("ready", &Controller::ready)
        .def("feedback", &Controller::feedback)
        .def("step", &Controller::step)
        .def("replay", &Controller::replay);
    nb::class_<Qp>(module, "Qp")
        .def(nb::init<int, int>(), "variables"_a, "rows"_a)
        .def("solve", &Qp::solve, "hessian"_a, "gradient"_a, "lower"_a, "upper"_a, "matrix"_a, "row_lower"_a,
             "row_upper"_a, "l1"_a, "l2"_a, "settings"_a, "warm"_a, "v"_a, "multipliers"_a);
}
