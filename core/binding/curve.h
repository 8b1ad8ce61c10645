// A curve in pieces, for Python. It keeps the arrays that it is made of; they are not to be changed.
#ifndef RUMO_BINDING_CURVE_H
#define RUMO_BINDING_CURVE_H

#include <nanobind/nanobind.h>

#include <optional>

#include "arrays.h"

namespace {

class Curve {
public:
    Curve(nb::handle breaks, nb::handle coefficients, nb::handle shift, int pieces, int values, int order)
        : api_(portable_table()) {
        if (pieces < 1 || values < 1 || order < 1) throw nb::value_error("a curve has pieces, and a value");
        const auto p = static_cast<std::size_t>(pieces), v = static_cast<std::size_t>(values);
        breaks_.emplace(breaks, p + 1, "breaks");
        coefficients_.emplace(coefficients, p * v * static_cast<std::size_t>(order), "coefficients");
        if (!shift.is_none()) shift_.emplace(shift, v, "shift");
        curve_ = {pieces, values, order, breaks_->data(), coefficients_->data(), shift_ ? shift_->data() : nullptr};
    }

    void at(nb::handle s, std::size_t count, nb::handle values) const {
        const Vector from(s, count, "s"), to(values, count * static_cast<std::size_t>(curve_.values), "values");
        api_->curve_at(&curve_, from.data(), static_cast<std::ptrdiff_t>(count), to.writable());
    }

    void when(nb::handle places, std::size_t count, nb::handle times) const {
        if (curve_.values < 3) throw nb::value_error("a motion has a place, a speed and an acceleration");
        const Vector from(places, count, "places"), to(times, count, "times");
        api_->curve_when(&curve_, from.data(), static_cast<std::ptrdiff_t>(count), to.writable());
    }

    double nearest(double x, double y, double low, double high) const {
        if (curve_.values < 2) throw nb::value_error("a position has two values");
        return api_->curve_nearest(&curve_, x, y, low, high);
    }

private:
    const rumo_api *api_;
    rumo_curve curve_{};
    std::optional<Vector> breaks_, coefficients_, shift_;
};

} // namespace

#endif
