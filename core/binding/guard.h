// The failure policy by itself, for Python.
#ifndef RUMO_BINDING_GUARD_H
#define RUMO_BINDING_GUARD_H

#include <nanobind/nanobind.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "arrays.h"
#include "description.h"

namespace {

// The failure policy by itself, see rumo_core.h. Inner unknowns are (N, ni).
class Guard {
public:
    Guard(nb::dict values, nb::dict settings) : api_(portable_table()) {
        Description d(values);
        const auto data = d.read<rumo_guard_data>();
        raise_if(api_->guard_check(&data));
        const rumo_settings chosen = settings_from(settings);
        sizes_ = data.sizes;
        const auto *s = &sizes_;
        inner_ = static_cast<std::size_t>(s->horizon * RUMO_INNER);
        memory_ = std::make_unique<unsigned char[]>(api_->guard_size(&data));
        guard_ = api_->guard_create(&data, &chosen, memory_.get());
    }

    void configure(nb::dict settings) {
        const rumo_settings chosen = settings_from(settings);
        api_->guard_configure(guard_, &chosen);
    }

    void update(nb::dict values) {
        Description d(values);
        const auto numbers = d.numbers(sizes_);
        raise_if(api_->guard_update(guard_, &numbers.bounds));
    }

    void reset() { api_->guard_reset(guard_); }

    void set_applied(nb::handle inputs) {
        const Vector values(inputs, decided(), "applied");
        std::copy_n(values.data(), decided(), api_->guard_applied(guard_));
    }

    void get_applied(nb::handle inputs) {
        const Vector values(inputs, decided(), "applied");
        std::copy_n(api_->guard_applied(guard_), decided(), values.writable());
    }

    std::vector<long long> counts() {
        const long long *counts = api_->guard_counts(guard_);
        return std::vector<long long>(counts, counts + RUMO_STATUS_COUNT);
    }

    void rest(nb::handle u) {
        const Vector out(u, inputs(), "u");
        api_->guard_rest(guard_, out.writable());
    }

    bool keep(double straying) { return api_->guard_keep(guard_, straying) != 0; }

    void drop() { api_->guard_drop(guard_); }

    int admit(nb::handle x, nb::handle reference, std::size_t count, nb::object reach) {
        const auto nx = static_cast<std::size_t>(sizes_.states);
        const Vector state(x, nx, "x"), wanted(reference, count, "reference");
        std::unique_ptr<Vector> reached;
        if (!reach.is_none()) reached = std::make_unique<Vector>(reach, nx, "reach");
        return api_->guard_admit(guard_, state.data(), wanted.data(), static_cast<int>(count),
                                 reached ? reached->data() : nullptr);
    }

    nb::tuple follow(nb::object u, nb::object x, nb::object inner, int cause) {
        if (cause < 0 || cause >= RUMO_STATUS_COUNT) throw nb::value_error("cause: expected a status");
        auto why = static_cast<rumo_status>(cause);
        rumo_status status;
        if (u.is_none()) {
            status = api_->guard_follow(guard_, nullptr, nullptr, nullptr, &why);
        } else {
            const Vector wanted(u, inputs(), "u"), states(x, window(), "x"), others(inner, inner_, "inner");
            status = api_->guard_follow(guard_, wanted.data(), states.data(), others.data(), &why);
        }
        return nb::make_tuple(static_cast<int>(status), static_cast<int>(why));
    }

    // Writes the plan into arrays; the one a sample later if `later`, false where there is none.
    bool plan(nb::handle u, nb::handle x, nb::handle inner, bool later) {
        const Vector inputs_out(u, inputs(), "u"), states(x, window(), "x"), others(inner, inner_, "inner");
        const auto now = state();
        if (later && !now.next_u) return false;
        std::copy_n(later ? now.next_u : now.u, inputs(), inputs_out.writable());
        std::copy_n(later ? now.next_x : now.x, window(), states.writable());
        std::copy_n(later ? now.next_inner : now.inner, inner_, others.writable());
        return true;
    }

    void take_back() { api_->guard_take_back(guard_); }

    // Writes the measurement that was admitted as it is to be used.
    void taken(nb::handle x) {
        const auto nx = static_cast<std::size_t>(sizes_.states);
        const Vector out(x, nx, "x");
        std::copy_n(api_->guard_taken(guard_), nx, out.writable());
    }

    void health(nb::handle symptoms) {
        const auto count = 3 * static_cast<std::size_t>(sizes_.states);
        const Vector out(symptoms, count, "symptoms");
        std::copy_n(api_->guard_health(guard_), count, out.writable());
    }

    bool surprised() const { return api_->guard_surprised(guard_) != 0; }

    void expect(nb::handle A) {
        const auto nx = static_cast<std::size_t>(sizes_.states);
        const Vector matrix(A, nx * nx, "A");
        api_->guard_expect(guard_, matrix.data());
    }

    // Writes a measurement with its angles next to what is predicted.
    void unwound(nb::handle x, nb::handle taken) {
        const auto nx = static_cast<std::size_t>(sizes_.states);
        const Vector state(x, nx, "x"), out(taken, nx, "taken");
        std::copy_n(api_->guard_unwound(guard_, state.data()), nx, out.writable());
    }

    rumo_guard_state state() const {
        rumo_guard_state state;
        api_->guard_state(guard_, &state);
        return state;
    }

private:
    std::size_t decided() const { return static_cast<std::size_t>(std::max(sizes_.delay, 1) * sizes_.inputs); }
    std::size_t inputs() const { return static_cast<std::size_t>(sizes_.horizon * sizes_.inputs); }
    std::size_t window() const { return static_cast<std::size_t>((sizes_.horizon + 1) * sizes_.states); }

    const rumo_api *api_;
    rumo_sizes sizes_{};
    std::size_t inner_ = 0;
    std::unique_ptr<unsigned char[]> memory_;
    rumo_guard *guard_ = nullptr;
};

} // namespace

#endif
