// Functions of one number, and their adjoints, chosen by -D FUNCTION. y may be x, dx may be dy.
// UNIT and SIGNED_UNIT are MGNet's output activations: clamp(1.01 sigmoid(x), 0, 1) and clamp(1.01 tanh(x), -1, 1),
// which reach their ends at finite x; their derivative beyond is 0. sigmoid(x) = e / (1 + e) with e = exp(-|x|) never
// overflows; derivatives are taken from the outputs, s (1 - s) and 1 - t^2, so that saturation gives 0 and not NaN.
// A NaN stays one: fmin, fmax and clamp would make a number of it.
#include "lib/lanes.clh"

#define RELU 0
#define UNIT 1
#define SIGNED_UNIT 2
#define EXP 3
#define LOG 4
#define SOFTPLUS 5
#define SQUARE 6
#define LOG1P 7
#define RELU6 8
#define TANH 9
#define TANGENT 10

// tan(0.999 pi x / 2): what Li et al. 2020 make of a number in [0, 1], up to 636.6. Near 1 as one over the tangent of what
// is left to a right angle, in which 1 - x is exact.
#define REACH R(0.999)
#define RIGHT_ANGLE R(1.57079632679489661923)
static inline lanes tangent(const lanes x) {
  const lanes rest = (R(1) - x) + R(0.001) * x;
  const lanes turned = tan(RIGHT_ANGLE * WHERE(x > R(0.5), rest, REACH * x));
  return WHERE(x > R(0.5), R(1) / turned, turned);
}

static inline lanes sigmoid(const lanes x) {
  const lanes e = exp(-fabs(x));
  return WHERE(x >= R(0), (lanes)(R(1)) / (R(1) + e), e / (R(1) + e));
}

static inline lanes value_of(const lanes x) {
#if FUNCTION == RELU
  return WHERE(x < R(0), (lanes)(R(0)), x);
#elif FUNCTION == UNIT
  const lanes y = R(1.01) * sigmoid(x);
  return WHERE(y > R(1), (lanes)(R(1)), y);
#elif FUNCTION == SIGNED_UNIT
  const lanes y = R(1.01) * tanh(x);
  return WHERE(fabs(y) > R(1), sign(y), y);
#elif FUNCTION == EXP
  return exp(x);
#elif FUNCTION == LOG
  return log(x);
#elif FUNCTION == SOFTPLUS
  return fmax(x, (lanes)(R(0))) + log1p(exp(-fabs(x)));
#elif FUNCTION == SQUARE
  return x * x;
#elif FUNCTION == LOG1P
  return log1p(x);
#elif FUNCTION == RELU6
  const lanes y = WHERE(x < R(0), (lanes)(R(0)), x);
  return WHERE(y > R(6), (lanes)(R(6)), y);
#elif FUNCTION == TANH
  return tanh(x);
#elif FUNCTION == TANGENT
  return tangent(x);
#endif
}

static inline lanes derivative_of(const lanes x) {
#if FUNCTION == RELU
  return WHERE(x > R(0), (lanes)(R(1)), (lanes)(R(0)));
#elif FUNCTION == UNIT
  const lanes s = sigmoid(x);
  return WHERE(R(1.01) * s < R(1), R(1.01) * s * (R(1) - s), (lanes)(R(0)));
#elif FUNCTION == SIGNED_UNIT
  const lanes t = tanh(x);
  return WHERE(R(1.01) * fabs(t) < R(1), R(1.01) * (R(1) - t * t), (lanes)(R(0)));
#elif FUNCTION == EXP
  return exp(x);
#elif FUNCTION == LOG
  return R(1) / x;
#elif FUNCTION == SOFTPLUS
  return sigmoid(x);
#elif FUNCTION == SQUARE
  return R(2) * x;
#elif FUNCTION == LOG1P
  return R(1) / (R(1) + x);
#elif FUNCTION == RELU6
  return WHERE(x > R(0) && x < R(6), (lanes)(R(1)), (lanes)(R(0)));
#elif FUNCTION == TANH
  const lanes t = tanh(x);
  return R(1) - t * t;
#elif FUNCTION == TANGENT
  const lanes t = tangent(x);
  return REACH * RIGHT_ANGLE * (R(1) + t * t);
#endif
}

#define ROW                                       \
  const int first = (int)get_group_id(0) * block; \
  const int n = (int)get_group_id(1);             \
  const int length = min(block, item - first);

kernel void activate(IN(x), OUT(y), const int item, const int block) {
  ROW
  global const real *x = AT(x, n) + first;
  global real *y = AT(y, n) + first;
  FOR_ROW(i, length) lanes_store(value_of(lanes_load(x + i, length - i)), y + i, length - i);
}

kernel void activate_adjoint(IN(dy), IN(x), OUT(dx), const int item, const int block) {
  ROW
  global const real *x = AT(x, n) + first;
  global const real *dy = AT(dy, n) + first;
  global real *dx = AT(dx, n) + first;
  FOR_ROW(i, length) {
    const lanes slope = derivative_of(lanes_load(x + i, length - i));
    lanes_store(slope * lanes_load(dy + i, length - i), dx + i, length - i);
  }
}
