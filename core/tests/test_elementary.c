/* Sine, cosine, tangent and arctangent against the C library's in long double. */
#include "base/elementary.h"

#include "check.h"
#include "random.h"

typedef long double exact_function(long double);

/* Two units in the last place, or 1e-15 relative. */
static int close_to(double value, long double exact) {
    const double size = fabs((double)exact);
    const long double unit = (long double)nextafter(size, INFINITY) - (long double)size;
    const long double error = fabsl((long double)value - exact);
    return error <= 2.0L * unit || error <= 1e-15L * fabsl(exact);
}

static void compare(double x) {
    const sine_cosine both = sine_and_cosine(x);
    CHECK(close_to(both.sine, sinl((long double)x)), "sin %.17g = %.17g", x, both.sine);
    CHECK(close_to(both.cosine, cosl((long double)x)), "cos %.17g = %.17g", x, both.cosine);
    CHECK(close_to(tangent(x), tanl((long double)x)), "tan %.17g = %.17g", x, tangent(x));
    CHECK(close_to(arctangent(x), atanl((long double)x)), "atan %.17g = %.17g", x, arctangent(x));
}

static void is_refused(double x) { CHECK(isnan(is_far(x)), "%g is not far", x); }

int main(void) {
    enum { MANY = 50000 };
    const double quarter = 0.78539816339744830962;
    const double special[] = {0.0,  5e-324, 2.2250738585072014e-308, 1e-20,   0.5,
                              0.66, 1.0,    2.41421356237309504880,  quarter, FAR_ANGLE};
    for (size_t i = 0; i < sizeof special / sizeof *special; ++i) {
        compare(special[i]);
        compare(-special[i]);
    }
    for (int i = 0; i < MANY; ++i) {
        compare(uniform(-10.0, 10.0));
        compare(uniform(-FAR_ANGLE, FAR_ANGLE));
        compare(of_any_size(1e-300, FAR_ANGLE));
        /* Zeros, poles and the ends of a reduction's intervals. */
        const double close = quarter * (below(1273238) - 636619);
        compare(close);
        compare(nextafter(close, INFINITY));
        compare(close + of_any_size(1e-16, 1e-3) * quarter);
    }
    CHECK(is_far(FAR_ANGLE) == 0.0 && is_far(-FAR_ANGLE) == 0.0 && is_far(0.0) == 0.0, "near angles");
    is_refused(nextafter(FAR_ANGLE, INFINITY));
    is_refused(-nextafter(FAR_ANGLE, INFINITY));
    is_refused(INFINITY);
    is_refused(-INFINITY);
    is_refused(NAN);
    for (int i = 0; i < MANY; ++i) {
        const double x = of_any_size(FAR_ANGLE * 1.0001, 1e300);
        is_refused(x);
        CHECK(close_to(arctangent(x), atanl((long double)x)), "atan %.17g = %.17g", x, arctangent(x));
    }
    CHECK(isnan(arctangent(NAN)), "atan NaN");
    CHECK(signbit(arctangent(-0.0)) && !signbit(arctangent(0.0)), "sign of atan 0");
    CHECK(arctangent(INFINITY) == 2.0 * quarter && arctangent(-INFINITY) == -2.0 * quarter, "atan inf");
    return finish();
}
