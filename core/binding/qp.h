// The QP solver by itself, for Python.
#ifndef RUMO_BINDING_QP_H
#define RUMO_BINDING_QP_H

#include <nanobind/nanobind.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "arrays.h"
#include "description.h"

namespace {

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

#endif
