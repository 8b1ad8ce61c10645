// The core for Python: arrays in, arrays out.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>

#include "controller.h"
#include "curve.h"
#include "filter.h"
#include "guard.h"
#include "integrator.h"
#include "qp.h"

using namespace nb::literals;

NB_MODULE(_core, module) {
#ifdef NDEBUG
    nb::set_leak_warnings(false); // a path that some module keeps may live until the interpreter is gone
#endif
    module.attr("VERSION") = RUMO_CORE_VERSION;
    module.attr("GATE_STAGES") = RUMO_GATE_STAGES;
    module.attr("SLACK_TOLERANCE") = RUMO_SLACK_TOLERANCE;
    module.attr("TABLES") = tables();
    module.def("build", [](std::uintptr_t table) { return std::string(table_at(table)->build); }, "table"_a = 0);
    nb::class_<Controller>(module, "Controller")
        .def(nb::init<std::uintptr_t, nb::dict, nb::dict, nb::object>(), "table"_a, "description"_a, "settings"_a,
             "layout"_a = nb::none())
        .def("configure", &Controller::configure, "settings"_a, "layout"_a = nb::none())
        .def("update", &Controller::update, "values"_a, "layout"_a = nb::none())
        .def("reset", &Controller::reset)
        .def("rest", &Controller::rest)
        .def("engage", &Controller::engage)
        .def("taken", &Controller::taken)
        .def("begins", &Controller::begins)
        .def("adopt", &Controller::adopt)
        .def("set_applied", &Controller::set_applied)
        .def("get_applied", &Controller::get_applied)
        .def("counts", &Controller::counts)
        .def("prepare", &Controller::prepare)
        .def("after_fork", &Controller::after_fork)
        .def("feedback", &Controller::feedback)
        .def("step", &Controller::step)
        .def("replay", &Controller::replay)
        .def_prop_ro("memory", &Controller::memory);
    nb::class_<Guard>(module, "Guard")
        .def(nb::init<nb::dict, nb::dict>(), "values"_a, "settings"_a)
        .def("configure", &Guard::configure)
        .def("update", &Guard::update)
        .def("reset", &Guard::reset)
        .def("set_applied", &Guard::set_applied)
        .def("get_applied", &Guard::get_applied)
        .def("counts", &Guard::counts)
        .def("rest", &Guard::rest)
        .def("keep", &Guard::keep)
        .def("drop", &Guard::drop)
        .def("admit", &Guard::admit, "x"_a, "reference"_a, "count"_a, "reach"_a.none())
        .def("follow", &Guard::follow, "u"_a.none(), "x"_a.none(), "inner"_a.none(), "cause"_a)
        .def("plan", &Guard::plan)
        .def("unwound", &Guard::unwound)
        .def("take_back", &Guard::take_back)
        .def("taken", &Guard::taken)
        .def("health", &Guard::health)
        .def_prop_ro("surprised", &Guard::surprised)
        .def("expect", &Guard::expect)
        .def_prop_ro("has_guess", [](const Guard &guard) { return guard.state().has_guess != 0; });
    nb::class_<Filter>(module, "Filter")
        .def(nb::init<nb::dict, nb::dict>(), "description"_a, "settings"_a)
        .def("covariance", &Filter::covariance)
        .def("advance", &Filter::advance)
        .def("linearise", &Filter::linearise);
    nb::class_<Integrator>(module, "Integrator")
        .def(nb::init<nb::dict, std::uintptr_t>(), "description"_a, "code"_a = 0)
        .def("reset", &Integrator::reset)
        .def("advance", &Integrator::advance)
        .def("algebraic", &Integrator::algebraic)
        .def("seek", &Integrator::seek)
        .def("work", &Integrator::work);
    nb::class_<Curve>(module, "Curve")
        .def(nb::init<nb::handle, nb::handle, nb::handle, int, int, int>(), "breaks"_a, "coefficients"_a, "shift"_a.none(),
             "pieces"_a, "values"_a, "order"_a)
        .def("at", &Curve::at)
        .def("nearest", &Curve::nearest)
        .def("when", &Curve::when);
    nb::class_<Qp>(module, "Qp")
        .def(nb::init<int, int>(), "variables"_a, "rows"_a)
        .def("solve", &Qp::solve, "hessian"_a, "gradient"_a, "lower"_a, "upper"_a, "matrix"_a, "row_lower"_a,
             "row_upper"_a, "l1"_a, "l2"_a, "settings"_a, "warm"_a, "v"_a, "multipliers"_a);
}
