// A system integrated over time, for Python. The interpreter lock is kept: a sample takes microseconds.
#ifndef RUMO_BINDING_INTEGRATOR_H
#define RUMO_BINDING_INTEGRATOR_H

#include <nanobind/nanobind.h>

#include <memory>

#include "arrays.h"
#include "description.h"

namespace {

class Integrator {
public:
    // With the address of a rumo_right_side, in whose library it must stay; 0 for tapes.
    Integrator(nb::dict description, std::uintptr_t code) : api_(portable_table()) {
        Description d(description);
        const auto system = d.read<rumo_system>();
        raise_if(api_->system_check(&system));
        sizes_ = system.sizes;
        memory_ = std::make_unique<unsigned char[]>(api_->integrator_size(&system));
        integrator_ = api_->integrator_create(&system, memory_.get());
        if (code == 0) return;
        const auto *right_side = reinterpret_cast<const rumo_right_side *>(code);
        if (right_side->version != RUMO_CORE_VERSION) throw nb::value_error("the tailored build belongs to another version");
        api_->integrator_tailor(integrator_, right_side);
    }

    void reset() { api_->integrator_reset(integrator_); }

    // How it ended, see rumo_ending.
    int advance(nb::handle x, nb::handle u, nb::handle p, double duration, nb::handle end) {
        const Vector from(x, states(), "x"), input(u, static_cast<std::size_t>(sizes_.inputs), "u"),
            parameters(p, static_cast<std::size_t>(sizes_.parameters), "p"), to(end, states(), "end");
        return static_cast<int>(api_->integrator_advance(integrator_, from.data(), input.data(), parameters.data(), duration,
                                                         to.writable()));
    }

    void algebraic(nb::handle z) const {
        const Vector to(z, static_cast<std::size_t>(sizes_.algebraic), "z");
        if (sizes_.algebraic > 0)
            std::memcpy(to.writable(), api_->integrator_algebraic(integrator_),
                        static_cast<std::size_t>(sizes_.algebraic) * sizeof(double));
    }

    void seek(nb::handle z) {
        const Vector from(z, static_cast<std::size_t>(sizes_.algebraic), "z");
        api_->integrator_seek(integrator_, from.data());
    }

    nb::dict work() const {
        const auto *w = api_->integrator_work(integrator_);
        nb::dict done;
        done["steps"] = w->steps;
        done["rejected"] = w->rejected;
        done["rates"] = w->rates;
        done["jacobians"] = w->jacobians;
        done["factors"] = w->factors;
        done["solutions"] = w->solutions;
        return done;
    }

private:
    std::size_t states() const { return static_cast<std::size_t>(sizes_.states); }

    const rumo_api *api_;
    rumo_sizes sizes_{};
    std::unique_ptr<unsigned char[]> memory_;
    rumo_integrator *integrator_ = nullptr;
};

} // namespace

#endif
