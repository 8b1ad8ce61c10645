// The extended Kalman filter for Python. The interpreter lock is kept: a step takes microseconds.
#ifndef RUMO_BINDING_FILTER_H
#define RUMO_BINDING_FILTER_H

#include <nanobind/nanobind.h>

#include <memory>

#include "arrays.h"
#include "description.h"

namespace {

class Filter {
public:
    Filter(nb::dict description, nb::dict settings) : api_(portable_table()) {
        Description d(description), told(settings);
        const auto problem = d.read<rumo_problem>();
        raise_if(api_->check(&problem));
        const auto data = told.filter(problem.sizes);
        raise_if(api_->filter_check(&problem, &data));
        sizes_ = problem.sizes;
        memory_ = std::make_unique<unsigned char[]>(api_->filter_size(&problem, &data));
        filter_ = api_->filter_create(&problem, &data, memory_.get());
    }

    void covariance(nb::handle belief, nb::handle P) const {
        const Vector from(belief, size(), "belief"), to(P, states() * states(), "covariance");
        api_->filter_covariance(filter_, from.data(), to.writable());
    }

    // Whether there is a belief to go on from.
    bool advance(nb::handle before, nb::handle u, nb::handle p, nb::handle y, nb::handle after, nb::handle report) {
        const Vector from(before, size(), "before"), input(u, static_cast<std::size_t>(sizes_.inputs), "applied"),
            parameters(p, static_cast<std::size_t>(sizes_.parameters), "parameters"), measured(y, outputs(), "measured"),
            to(after, size(), "after"), said(report, 3 * outputs() + 2, "report");
        return api_->filter_advance(filter_, from.data(), input.data(), parameters.data(), measured.data(), to.writable(),
                                    said.writable()) != 0;
    }

    // The same for the model alone.
    bool linearise(nb::handle x, nb::handle u, nb::handle p, nb::handle A, nb::handle y, nb::handle H) {
        const Vector state(x, states(), "x"), input(u, static_cast<std::size_t>(sizes_.inputs), "applied"),
            parameters(p, static_cast<std::size_t>(sizes_.parameters), "parameters"), of_x(A, states() * states(), "A"),
            measured(y, outputs(), "y"), of_y(H, outputs() * states(), "H");
        return api_->filter_linearise(filter_, state.writable(), input.data(), parameters.data(), of_x.writable(),
                                      measured.writable(), of_y.writable()) != 0;
    }

private:
    std::size_t states() const { return static_cast<std::size_t>(sizes_.states); }
    std::size_t outputs() const { return static_cast<std::size_t>(sizes_.outputs); }
    std::size_t size() const { return states() * (states() + 1) + outputs(); }

    const rumo_api *api_;
    rumo_sizes sizes_{};
    std::unique_ptr<unsigned char[]> memory_;
    rumo_filter *filter_ = nullptr;
};

} // namespace

#endif
