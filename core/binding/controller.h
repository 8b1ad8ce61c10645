// The real-time iteration for Python. The interpreter lock is released while the core works.
#ifndef RUMO_BINDING_CONTROLLER_H
#define RUMO_BINDING_CONTROLLER_H

#include <nanobind/nanobind.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <vector>

#include "arrays.h"
#include "description.h"

namespace {

class Controller {
public:
    // `layout` is the caller's, and comes back with each step: that of the numbers which the step was made with.
    Controller(std::uintptr_t table, nb::dict description, nb::dict settings, nb::object layout)
        : api_(table_at(table)), layout_(layout) {
        Description d(description);
        const auto problem = d.read<rumo_problem>();
        raise_if(portable_table()->check(&problem));
        const rumo_settings chosen = settings_from(settings);
        sizes_ = problem.sizes;
        bytes_ = api_->size(&problem);
        memory_ = std::make_unique<unsigned char[]>(bytes_);
        core_ = api_->create(&problem, &chosen, memory_.get());
        const auto &s = sizes_;
        count_ = static_cast<std::size_t>(s.horizon * s.inputs + (s.horizon + 1) * s.states +
                                          s.horizon * (s.constraints + s.algebraic) + RUMO_DIAGNOSTIC_COUNT);
    }

    void configure(nb::dict settings, nb::object layout) {
        const rumo_settings chosen = settings_from(settings);
        Lock lock(*this);
        api_->configure(core_, &chosen);
        layout_ = layout;
    }

    // Other numbers, by their names; those left out stay. What was prepared is prepared again.
    void update(nb::dict values, nb::object layout) {
        Description d(values);
        const auto numbers = d.numbers(sizes_);
        rumo_fault fault;
        {
            Lock lock(*this);
            const bool prepared = api_->prepared(core_) != 0;
            fault = api_->update(core_, &numbers);
            if (fault.error == RUMO_FINE) layout_ = layout;
            if (prepared && !api_->prepared(core_)) {
                nb::gil_scoped_release release;
                api_->prepare(core_);
            }
        }
        raise_if(fault);
    }

    void reset(nb::handle inputs) {
        const Vector values(inputs, decided(), "applied");
        Lock lock(*this);
        api_->reset(core_);
        std::copy_n(values.data(), decided(), api_->applied(core_));
    }

    void engage(nb::handle x, nb::handle u) {
        const Vector state(x, (static_cast<std::size_t>(sizes_.horizon) + 1) * states(), "x");
        const Vector inputs(u, static_cast<std::size_t>(sizes_.horizon * sizes_.inputs), "u");
        Lock lock(*this);
        api_->engage(core_, state.data(), inputs.data());
    }

    void rest(nb::handle x) {
        const Vector state(x, states(), "x");
        Lock lock(*this);
        api_->start(core_, state.data());
    }

    void set_applied(nb::handle inputs) {
        const Vector values(inputs, decided(), "applied");
        Lock lock(*this);
        std::copy_n(values.data(), decided(), api_->applied(core_));
    }

    void get_applied(nb::handle inputs) {
        const Vector values(inputs, decided(), "applied");
        Lock lock(*this);
        std::copy_n(api_->applied(core_), decided(), values.writable());
    }

    // The last measurement as it was used.
    void taken(nb::handle x) {
        const Vector out(x, states(), "x");
        Lock lock(*this);
        std::copy_n(api_->taken(core_), states(), out.writable());
    }

    // Where what was wanted then began.
    void begins(nb::handle wanted) {
        const Vector out(wanted, static_cast<std::size_t>(sizes_.outputs), "wanted");
        Lock lock(*this);
        std::copy_n(api_->begins(core_), static_cast<std::size_t>(sizes_.outputs), out.writable());
    }

    // Another plan for the sample of the last step; returns the status counted.
    int adopt(nb::handle u, nb::handle x, nb::handle inner, int status) {
        const auto horizon = static_cast<std::size_t>(sizes_.horizon);
        const Vector inputs(u, static_cast<std::size_t>(sizes_.horizon * sizes_.inputs), "u");
        const Vector state(x, (horizon + 1) * states(), "x");
        const Vector others(inner, horizon * inner_unknowns(), "inner");
        Lock lock(*this);
        return static_cast<int>(
            api_->adopt(core_, inputs.data(), state.data(), others.data(), static_cast<rumo_status>(status)));
    }

    std::vector<long long> counts() {
        Lock lock(*this);
        const long long *counts = api_->counts(core_);
        return std::vector<long long>(counts, counts + RUMO_STATUS_COUNT);
    }

    void prepare() {
        Lock lock(*this);
        api_->prepare(core_);
    }

    // Both write the plan's numbers into an array; (layout, status, cause, prepare, feedback, waited, iterations,
    // and None or what is in conflict as (kind, stage, index)). None where a feedback finds nothing prepared.
    nb::object feedback(nb::handle x, nb::handle reference, nb::handle numbers) {
        return run(api_->feedback, true, x, reference, numbers);
    }

    nb::object step(nb::handle x, nb::handle reference, nb::handle numbers) {
        return run(api_->step, false, x, reference, numbers);
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
    }

    // In a child process: of a thread that was in here, only its lock has come along.
    void after_fork() {
        orphaned_ = !mutex_.try_lock();
        if (!orphaned_) mutex_.unlock();
    }

    // Bytes, known before the first step.
    std::size_t memory() const { return bytes_; }

private:
    // Two threads may not be in one controller; waiting for the other must not hold the interpreter.
    struct Lock {
        explicit Lock(Controller &c) : lock_(c.mutex_, std::defer_lock) {
            if (!lock_.try_lock()) {
                if (c.orphaned_) {
                    const nb::object error = nb::module_::import_("rumo.errors").attr("ForkedError");
                    PyErr_SetNone(error.ptr());
                    throw nb::python_error();
                }
                nb::gil_scoped_release release;
                lock_.lock();
            }
        }
        std::unique_lock<std::mutex> lock_;
    };

    std::size_t inner_unknowns() const {
        const rumo_sizes *s = &sizes_;
        return static_cast<std::size_t>(RUMO_INNER);
    }
    std::size_t states() const { return static_cast<std::size_t>(sizes_.states); }
    std::size_t decided() const { return static_cast<std::size_t>(std::max(sizes_.delay, 1) * sizes_.inputs); }
    std::size_t window() const { return static_cast<std::size_t>((sizes_.horizon + 1) * sizes_.outputs); }

    nb::object run(void (*function)(rumo_controller *, const double *, const double *, rumo_plan *), bool when_prepared,
                   nb::handle x, nb::handle reference, nb::handle numbers) {
        const Vector state(x, states(), "x", 1, states()), out(numbers, count_, "numbers");
        const Vector wanted(reference, window(), "reference", 2, static_cast<std::size_t>(sizes_.outputs));
        rumo_plan plan;
        std::vector<rumo_conflict> limits; // copied while the controller is ours: another thread's step would overwrite them
        std::vector<double> symptoms;
        nb::object layout;
        {
            Lock lock(*this);
            if (when_prepared && !api_->prepared(core_)) return nb::none();
            layout = layout_;
            nb::gil_scoped_release release;
            function(core_, state.data(), wanted.data(), &plan);
            std::copy_n(plan.numbers, count_, out.writable());
            if (plan.conflicts > 0) limits.assign(plan.conflict, plan.conflict + plan.conflicts);
            if (plan.symptoms > 0) symptoms.assign(plan.health, plan.health + 3 * states());
        }
        nb::object health = nb::none();
        if (!symptoms.empty()) health = nb::cast(symptoms);
        nb::object conflict = nb::none();
        if (!limits.empty()) {
            nb::list found;
            for (const auto &limit : limits)
                found.append(nb::make_tuple(static_cast<int>(limit.kind), limit.stage, limit.index));
            conflict = found;
        }
        return nb::make_tuple(layout, static_cast<int>(plan.status), static_cast<int>(plan.cause), plan.prepare_seconds,
                              plan.feedback_seconds, plan.waited_seconds, plan.iterations, conflict, health);
    }

    const rumo_api *api_;
    rumo_sizes sizes_{};
    std::unique_ptr<unsigned char[]> memory_;
    rumo_controller *core_ = nullptr;
    std::size_t bytes_ = 0, count_ = 0;
    nb::object layout_;
    std::mutex mutex_;
    bool orphaned_ = false;
};

} // namespace

#endif
