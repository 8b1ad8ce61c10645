/* The model: a straight-line program run over all stages at once, eight at a time.
 *
 * A number of stage k lies in lane k: element e of the terms at terms[e * lanes + k]. Stages up to the next multiple
 * of LANES repeat the last one. A tailored build has the same programs as C code (see RUMO_EVALUATE in core.c).
 */
#ifndef RUMO_TAPE_C
#define RUMO_TAPE_C

#include "rumo_core.h"

#include "base/lanes.h"
#include "base/elementary.h"

enum { ARGUMENTS = 5 };

typedef struct guess_lanes {
    const double *first[ARGUMENTS]; /* element of each argument, */
    ptrdiff_t stride[ARGUMENTS];    /* and how far apart elements are */
} guess_lanes;

#ifndef RUMO_TAILORED

/* Registers hold CHUNK stages, so that decoding an instruction is paid for by several vector operations. */
#define CHUNK 16

/* As long as instructions are of one kind: the jump to it is taken once for all. Through a local array: a result may take
 * the register of an operand. */
#define EACH(expression)                                                                                       \
    do {                                                                                                       \
        double *const R = registers + (ptrdiff_t)code[1] * CHUNK;                                              \
        const double *const A = registers + (ptrdiff_t)code[2] * CHUNK;                                        \
        const double *const B = registers + (ptrdiff_t)code[3] * CHUNK;                                        \
        for (int j = 0; j < width; j += LANES) {                                                               \
            double result[LANES];                                                                              \
            for (int l = 0; l < LANES; ++l) {                                                                  \
                const double a = A[j + l], b = B[j + l];                                                       \
                (void)b;                                                                                       \
                result[l] = (expression);                                                                      \
            }                                                                                                  \
            copy(R + j, result, LANES);                                                                        \
        }                                                                                                      \
        operation = code[0];                                                                                   \
        code += 4;                                                                                             \
    } while (code < end && code[0] == operation);                                                              \
    break

static inline void copy_lanes(double *to, const double *from, int width) {
    for (int j = 0; j < width; j += LANES) copy(to + j, from + j, LANES);
}

static inline double sign_of(double a) { return a > 0.0 ? 1.0 : a < 0.0 ? -1.0 : a; }

/* A function of an angle: of any angle, or of those that are not far, else what comes of it is not 0. */
#define ANGLES(any, near)                      \
    if (far) {                                 \
        EACH(any);                             \
    }                                          \
    EACH((odd[j + l] += is_far(a), near))

/* The sum of 0 x over all outputs: not 0 where one of them is not finite, or where angles are far but not expected to be. */
static inline double run_chunk(const rumo_tape *tape, const guess_lanes *in, int first, const int width, int lanes,
                               double *restrict registers, double *restrict terms, const int far) {
    const int *code = tape->code, *const end = code + 4 * (ptrdiff_t)tape->length;
    double odd[CHUNK] = {0.0};
    while (code < end) {
        int operation;
        switch ((rumo_operation)code[0]) {
        case RUMO_CONSTANT:
            for (int j = 0; j < width; ++j) registers[(ptrdiff_t)code[1] * CHUNK + j] = tape->constants[(code - tape->code) / 4];
            code += 4;
            break;
        case RUMO_INPUT:
            copy_lanes(registers + (ptrdiff_t)code[1] * CHUNK, in->first[code[2]] + code[3] * in->stride[code[2]] + first, width);
            code += 4;
            break;
        case RUMO_OUTPUT: {
            const double *const A = registers + (ptrdiff_t)code[2] * CHUNK;
            copy_lanes(terms + (ptrdiff_t)code[1] * lanes + first, A, width);
            for (int j = 0; j < width; j += LANES)
                for (int l = 0; l < LANES; ++l) odd[j + l] += 0.0 * A[j + l];
            code += 4;
            break;
        }
        case RUMO_ASSIGN: EACH(a);
        case RUMO_ADD: EACH(a + b);
        case RUMO_SUB: EACH(a - b);
        case RUMO_MUL: EACH(a * b);
        case RUMO_DIV: EACH(a / b);
        case RUMO_NEG: EACH(-a);
        case RUMO_INV: EACH(1.0 / a);
        case RUMO_SQ: EACH(a * a);
        case RUMO_TWICE: EACH(2.0 * a);
        case RUMO_SQRT: EACH(sqrt(a));
        case RUMO_SIN: ANGLES(sin(a), sine(a));
        case RUMO_COS: ANGLES(cos(a), cosine(a));
        case RUMO_TAN: ANGLES(tan(a), tangent(a));
        case RUMO_ASIN: EACH(asin(a));
        case RUMO_ACOS: EACH(acos(a));
        case RUMO_ATAN: EACH(arctangent(a));
        case RUMO_ATAN2: EACH(atan2(a, b));
        case RUMO_SINH: EACH(sinh(a));
        case RUMO_COSH: EACH(cosh(a));
        case RUMO_TANH: EACH(tanh(a));
        case RUMO_ASINH: EACH(asinh(a));
        case RUMO_ACOSH: EACH(acosh(a));
        case RUMO_ATANH: EACH(atanh(a));
        case RUMO_EXP: EACH(exp(a));
        case RUMO_EXPM1: EACH(expm1(a));
        case RUMO_LOG: EACH(log(a));
        case RUMO_LOG1P: EACH(log1p(a));
        case RUMO_POW: EACH(pow(a, b));
        case RUMO_HYPOT: EACH(hypot(a, b));
        case RUMO_ERF: EACH(erf(a));
        case RUMO_FABS: EACH(fabs(a));
        case RUMO_SIGN: EACH(sign_of(a));
        case RUMO_COPYSIGN: EACH(copysign(a, b));
        case RUMO_FLOOR: EACH(floor(a));
        case RUMO_CEIL: EACH(ceil(a));
        case RUMO_FMOD: EACH(fmod(a, b));
        case RUMO_FMIN: EACH(minimum(a, b));
        case RUMO_FMAX: EACH(maximum(a, b));
        case RUMO_LT: EACH(a < b ? 1.0 : 0.0);
        case RUMO_LE: EACH(a <= b ? 1.0 : 0.0);
        case RUMO_EQ: EACH(a == b ? 1.0 : 0.0);
        case RUMO_NE: EACH(a != b ? 1.0 : 0.0);
        case RUMO_NOT: EACH(a == 0.0 ? 1.0 : 0.0);
        case RUMO_AND: EACH(a != 0.0 && b != 0.0 ? 1.0 : 0.0);
        case RUMO_OR: EACH(a != 0.0 || b != 0.0 ? 1.0 : 0.0);
        case RUMO_IF_ELSE_ZERO: EACH(a != 0.0 ? b : 0.0);
        case RUMO_OPERATION_COUNT: code = end; break;
        }
    }
    return sum_of_lanes(odd) + sum_of_lanes(odd + LANES);
}

#undef ANGLES
#undef EACH

/* As evaluate, for angles of any size. */
RARE static int evaluate_far(const rumo_tape *tape, const guess_lanes *in, int lanes, double *registers, double *terms) {
    double odd = 0.0;
    for (int first = 0; first < lanes; first += LANES) odd += run_chunk(tape, in, first, LANES, lanes, registers, terms, 1);
    return odd == 0.0;
}

/* Whether all that it computes is finite. */
static int evaluate(const rumo_tape *tape, const guess_lanes *in, int lanes, double *registers, double *terms) {
    int first = 0;
    double odd = 0.0;
    for (; first + CHUNK <= lanes; first += CHUNK) odd += run_chunk(tape, in, first, CHUNK, lanes, registers, terms, 0);
    if (first < lanes) odd += run_chunk(tape, in, first, LANES, lanes, registers, terms, 0);
    return odd == 0.0 || evaluate_far(tape, in, lanes, registers, terms);
}

#define evaluate_inner evaluate

#endif

#ifdef RUMO_TAILORED
#include RUMO_EVALUATE
#endif

#endif
