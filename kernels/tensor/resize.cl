// Resampling of planes: {N, C, H, W} -> {N, C, h, w}. Rows of a work-group: `rows` rows of each of `planes` planes.
// Bilinear with align_corners: output i reads the input at i (in - 1) / (out - 1), computed in integers, so that no
// rounding decides between neighbours. A size of 1 reads input 0. CENTRES: without, at (i + 1/2) in / out - 1/2, and
// beyond the outer centres what these hold.
#include "lib/lanes.clh"

// Where output i of `outs` falls among `ins` inputs: between *at and *at + 1, at `fraction` of the way.
static inline real position(const int i, const int ins, const int outs, int *at) {
#ifdef CENTRES
  const int steps = 2 * outs, numerator = clamp((2 * i + 1) * ins - outs, 0, steps * (ins - 1));
#else
  const int steps = max(outs - 1, 1), numerator = i * (ins - 1);
#endif
  *at = min(numerator / steps, max(ins - 2, 0));
  return ins > 1 ? (real)(numerator - *at * steps) / (real)steps : R(0);
}

// The planes of a work-group: tables are made once for all of them.
#define FOR_PLANES(c) \
  for (int c = (int)get_group_id(1) * planes; c < min(((int)get_group_id(1) + 1) * planes, channels); ++c)
#define FOR_LANES(x, w) for (int x = (int)get_local_id(0); x < (w); x += GROUP)

// Lines in local memory have room for whole vectors: no tails. Doubling a size makes 16 neighbours read every number
// twice (or, backwards, every other number) but for the few vectors where the ratio, which is not quite 2, skips one: a
// fixed shuffle of one or two loads, which costs a fraction of a gather. `pattern` tells which it is, per vector.
#if GROUP == 1
#define LINE_LOAD(p) vload16(0, p)
#define LINE_STORE(v, p) vstore16(v, 0, p)
#define LANE_INDEX (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
enum { ANY, TWICE, TWICE_BUT_FIRST, EVERY_OTHER };

static inline int pattern_of(local const int *at) {
  const int16 steps = vload16(0, at) - at[0];
  if (all(steps == LANE_INDEX >> 1)) return TWICE;
  if (all(steps == (LANE_INDEX + 1) >> 1)) return TWICE_BUT_FIRST;
  return all(steps == LANE_INDEX << 1) ? EVERY_OTHER : ANY;
}

#define AT_LANE(k) p[at[k] + shift]
#define GATHER16                                                                                                       \
  (real16)(AT_LANE(0), AT_LANE(1), AT_LANE(2), AT_LANE(3), AT_LANE(4), AT_LANE(5), AT_LANE(6), AT_LANE(7), AT_LANE(8), \
           AT_LANE(9), AT_LANE(10), AT_LANE(11), AT_LANE(12), AT_LANE(13), AT_LANE(14), AT_LANE(15))

// p[at[lane] + shift], from a row of `length` numbers.
static inline lanes read_row(global const real *p, const int length, local const int *at, const int shift,
                             const int pattern) {
  const int first = at[0] + shift;
  if (pattern == TWICE) return lanes_load(p + first, length - first).s0011223344556677;
  if (pattern == TWICE_BUT_FIRST) return lanes_load(p + first, length - first).s0112233445566778;
  return GATHER16;
}

// p[at[lane] + shift], from a line that has room for two vectors beyond any at.
static inline lanes read_line(local const real *p, local const int *at, const int shift, const int pattern) {
  if (pattern != EVERY_OTHER) return GATHER16;
  local const real *first = p + at[0] + shift;
  return (real16)(vload16(0, first).even, vload16(1, first).even);
}
#else
#define LINE_LOAD(p) (*(p))
#define LINE_STORE(v, p) (*(p) = (v))
static inline int pattern_of(local const int *at) { return 0; }
static inline lanes read_row(global const real *p, const int length, local const int *at, const int shift,
                             const int pattern) {
  return p[*at + shift];
}
static inline lanes read_line(local const real *p, local const int *at, const int shift, const int pattern) {
  return p[*at + shift];
}
#endif

// Each input row is brought to the new width once, and two such lines are blended for each output row: input row r
// stays in half r % 2 of `lines` until row r + 2 takes its place. lines, fractions, ats: local memory of 2 `pitch`,
// pitch, pitch numbers; pitch is w in whole vectors.
kernel void resize_bilinear(IN(x), OUT(y), const int channels, const int height, const int width, const int h,
                            const int w, const int rows, const int planes, const int pitch, local real *lines,
                            local real *fractions, local int *ats) {
  const int n = (int)get_group_id(2);
  FOR_LANES(i, pitch) {
    int at;
    fractions[i] = position(min(i, w - 1), width, w, &at);
    ats[i] = at;
  }
  const int first = (int)get_group_id(0) * rows, last = min(first + rows, h);
  const int right = width > 1 ? 1 : 0, below = height > 1 ? 1 : 0;
  FOR_PLANES(c) {
    global const real *from = AT(x, n) + (ulong)c * height * width;
    global real *to = AT(y, n) + (ulong)c * h * w;
    int held[2] = {-1, -1};
    for (int j = first; j < last; ++j) {
      int above;
      const real f = position(j, height, h, &above);
      GROUP_BARRIER;
      for (int k = above; k <= above + below; ++k) {
        if (held[k & 1] == k) continue;
        held[k & 1] = k;
        global const real *row = from + k * width;
        local real *line = lines + (k & 1) * pitch;
        FOR_ROW(i, w) {
          const int pattern = pattern_of(ats + i);
          const lanes left = read_row(row, width, ats + i, 0, pattern);
          const lanes next = read_row(row, width, ats + i, right, pattern);
          LINE_STORE(left + LINE_LOAD(fractions + i) * (next - left), line + i);
        }
      }
      GROUP_BARRIER;
      local const real *a = lines + (above & 1) * pitch, *b = lines + ((above + below) & 1) * pitch;
      FOR_ROW(i, w) {
        const lanes top = LINE_LOAD(a + i);
        lanes_store(top + f * (LINE_LOAD(b + i) - top), to + j * w + i, w - i);
      }
    }
  }
}

// The outputs that read input i with weight above 0 begin at the least o with o (ins - 1) > (i - 1) (outs - 1), or with
// CENTRES (2 o + 1) ins > (2 i - 1) outs.
static inline int first_reader(const int i, const int ins, const int outs) {
  if (i <= 0 || ins == 1) return 0;
#ifdef CENTRES
  const int past = (2 * i - 1) * outs - ins;
  return past < 0 ? 0 : min(past / (2 * ins) + 1, outs - 1);
#else
  return min((i - 1) * (outs - 1) / (ins - 1) + 1, outs - 1);
#endif
}

// Weight of input i in output o.
static inline real reader_weight(const int o, const int i, const int ins, const int outs) {
  if (o < 0 || o >= outs) return R(0);
  int at;
  const real f = position(o, ins, outs, &at);
  return at == i ? R(1) - f : at + 1 == i ? f : R(0);
}

#define READERS 4  // rows summed at once
#define BEFORE 2   // zeros before the line
#define LINE_OF(c) (lines + ((c) - (int)get_group_id(1) * planes) * line_pitch)

// dx: each input gathers from its readers, at most `most_y` x `most_x` of them: first their rows, then along the sum.
// lines, weights, firsts: local memory of planes line_pitch (w + most_x + 32 in whole vectors), most_x pitch, pitch
// numbers; pitch is W in whole vectors.
kernel void resize_bilinear_adjoint(IN(dy), OUT(dx), const int channels, const int height, const int width, const int h,
                                    const int w, const int most_y, const int most_x, const int rows, const int planes,
                                    const int line_pitch, const int pitch, local real *lines, local real *weights,
                                    local int *firsts) {
  const int n = (int)get_group_id(2);
  FOR_LANES(i, pitch) {
    int reader = first_reader(min(i, width - 1), width, w);
    if (i == 0 && width > 2) {  // begins before the line, where there are zeros, if that keeps the pattern
      const int second = first_reader(1, width, w);
      reader = clamp(2 * second - first_reader(2, width, w), -BEFORE, 0);
    }
    firsts[i] = BEFORE + reader;
    for (int k = 0; k < most_x; ++k) weights[k * pitch + i] = reader_weight(reader + k, i, width, w);
  }
  FOR_LANES(i, planes * line_pitch) lines[i] = R(0);
  const int first = (int)get_group_id(0) * rows, last = min(first + rows, height);
  for (int j = first; j < last; ++j) {
    const int reader = first_reader(j, height, h);
    for (int k = 0; k < most_y; k += READERS) {
      real weight[READERS];
      int row[READERS];
      for (int r = 0; r < READERS; ++r) {
        weight[r] = reader_weight(reader + k + r, j, height, h);
        row[r] = min(reader + k + r, h - 1) * w;
      }
      if (k > 0 && weight[0] == R(0)) break;
      // All lines first, then all sums along them: a load so soon after its store would wait for it.
      GROUP_BARRIER;
      FOR_PLANES(c) {
        global const real *from = AT(dy, n) + (ulong)c * h * w;
        local real *line = LINE_OF(c) + BEFORE;
        FOR_ROW(i, w) {
          const int left = w - i;
          LINE_STORE(
              (weight[0] * lanes_load(from + row[0] + i, left) + weight[1] * lanes_load(from + row[1] + i, left)) +
                  (weight[2] * lanes_load(from + row[2] + i, left) + weight[3] * lanes_load(from + row[3] + i, left)),
              line + i);
        }
      }
      GROUP_BARRIER;
      FOR_ROW(i, width) {
        const int pattern = pattern_of(firsts + i);
        FOR_PLANES(c) {
          global real *to = AT(dx, n) + ((ulong)c * height + j) * width + i;
          lanes sum = k > 0 ? lanes_load(to, width - i) : (lanes)(R(0));
          for (int m = 0; m < most_x; ++m)
            sum += LINE_LOAD(weights + m * pitch + i) * read_line(LINE_OF(c), firsts + i, m, pattern);
          lanes_store(sum, to, width - i);
        }
      }
    }
  }
}

// y = mean of the input over the output pixel's box [i H / h, (i + 1) H / h), parts of pixels counted as such.
kernel void resize_area(IN(x), OUT(y), const int height, const int width, const int h, const int w) {
  const int i = (int)get_global_id(0), c = (int)get_global_id(1), n = (int)get_global_id(2);
  if (i >= h * w) return;
  const int row = i / w, column = i - row * w;
  global const real *from = AT(x, n) + (ulong)c * height * width;
  // In integers, so that no weight is rounded below 0: borders and overlaps in 1/h of an input row, 1/w of a column.
  const int top = row * height, bottom = top + height, left = column * width, right = left + width;
  const int y0 = top / h, y1 = (bottom + h - 1) / h, x0 = left / w, x1 = (right + w - 1) / w;
  real sum = R(0);
  for (int sy = y0; sy < y1; ++sy) {
    real line = R(0);
    for (int sx = x0; sx < x1; ++sx)
      line += (real)(min(right, (sx + 1) * w) - max(left, sx * w)) * from[sy * width + sx];
    sum += (real)(min(bottom, (sy + 1) * h) - max(top, sy * h)) * line;
  }
  AT(y, n)[(ulong)c * h * w + i] = sum / ((real)height * (real)width);
}

// y = the input pixel that holds the output pixel's centre.
kernel void resize_nearest(IN(x), OUT(y), const int height, const int width, const int h, const int w) {
  const int i = (int)get_global_id(0), c = (int)get_global_id(1), n = (int)get_global_id(2);
  if (i >= h * w) return;
  const int row = i / w, column = i - row * w;
  const int sy = (2 * row + 1) * height / (2 * h), sx = (2 * column + 1) * width / (2 * w);
  AT(y, n)[(ulong)c * h * w + i] = AT(x, n)[((ulong)c * height + sy) * width + sx];
}
