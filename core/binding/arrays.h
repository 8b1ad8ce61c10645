// Which core there is, and arrays from Python.
#ifndef RUMO_BINDING_ARRAYS_H
#define RUMO_BINDING_ARRAYS_H

#include <nanobind/nanobind.h>

#include <cstring>
#include <string>

#include "rumo_core.h"

extern "C" {
extern const rumo_api rumo_core_baseline;
#ifdef RUMO_X86_VARIANTS
extern const rumo_api rumo_core_v3;
extern const rumo_api rumo_core_v4;
#endif
}

namespace nb = nanobind;

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

// Contiguous doubles of a given length, without a copy where the argument already is that; and of a number of dimensions
// and columns, where given.
class Vector {
public:
    Vector(nb::handle object, std::size_t length, const char *name, int dimensions = 0, std::size_t columns = 0) {
        if (PyObject_GetBuffer(object.ptr(), &view_, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0) nb::raise_python_error();
        const bool doubles = view_.format && std::strcmp(view_.format, "d") == 0;
        const bool shaped = dimensions == 0 || (view_.ndim == dimensions &&
                                                static_cast<std::size_t>(view_.shape[dimensions - 1]) == columns);
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

} // namespace

#endif
