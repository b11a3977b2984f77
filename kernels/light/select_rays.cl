// The rays that need one part of the light, as a list in ascending order: blocks of fixed length count theirs, the
// counts are summed in order, every block places its own. No atomics: same list run to run, on any device. A block is a
// work-group's (lib/lanes.clh), each item of which takes a run of its rays.
//
// u {1, 1, pixels, samples}, hit Int {1, 1, ...}: pixel or -1, direction {1, 3, ...} (kernels/lib/chunk.clh). A ray is
// wanted when it lies inside the chunk, has a direction other than (0, 0, 0), and
//   in view (out_of_view = 0): hit >= 0 and u < 1 - epsilon;   out of view: u > epsilon (-1: every u).
// list Int: the wanted rays' numbers p * samples + s, then -1 for as many as are not wanted; count Int {1, 1, 1, 1}.
#include "lib/chunk.clh"
#include "lib/scan.clh"

#define WANTED_ARGS \
  IN(u), IN_INT(hit), IN(direction), CHUNK_ARGS, const int out_of_view, const real epsilon, const int length
// The item's rays of its group's block b, begin ... end - 1.
#define RUN_OF_BLOCK                                        \
  const int b = (int)get_group_id(0), run = length / GROUP; \
  const int begin = b * length + run * (int)get_local_id(0), end = min(begin + run, (int)RAY_PLANE);
#define FOR_RUN(i) for (int i = begin; i < end; ++i)
#define IS_WANTED(ray)                                                                                             \
  is_wanted(AT(u, 0)[ray], AT(hit, 0)[ray], AT(direction, 0) + (ray), RAY_PLANE, (ray) / sample_capacity < pixels, \
            (ray) % sample_capacity < samples, out_of_view, epsilon)

static inline int is_wanted(real u, int hit, global const real *d, ulong plane, int in_rows, int in_samples,
                            int out_of_view, real epsilon) {
  const int moves = d[0] != R(0) || d[plane] != R(0) || d[2 * plane] != R(0);
  const int counts = out_of_view ? u > epsilon : (hit >= 0 && u < R(1) - epsilon);
  return in_rows && in_samples && moves && counts;
}

// counts {blocks}.
kernel void count_wanted(WANTED_ARGS, OUT_INT(counts)) {
  local int sums[GROUP];
  RUN_OF_BLOCK
  int own = 0, all;
  FOR_RUN(i) own += IS_WANTED(i);
  group_before(own, sums, &all);
  if (get_local_id(0) == 0) AT(counts, 0)[b] = all;
}

// counts become where each block's rays begin in the list; their sum is the count. One work-group.
kernel void begin_blocks(OUT_INT(counts), const int blocks, OUT_INT(count)) {
  local int sums[GROUP];
  const int sum = scan_exclusive(AT(counts, 0), blocks, sums);
  if (get_local_id(0) == 0) AT(count, 0)[0] = sum;
}

// Every ray has one place: wanted ones in order from the front, the others behind the last wanted one.
kernel void place_wanted(WANTED_ARGS, IN_INT(counts), IN_INT(count), OUT_INT(list)) {
  local int sums[GROUP];
  RUN_OF_BLOCK
  int own = 0, all;
#if GROUP > 1
  FOR_RUN(i) own += IS_WANTED(i);
#endif
  int at = AT(counts, 0)[b] + group_before(own, sums, &all), other = AT(count, 0)[0] + begin - at;
  FOR_RUN(i)
    if (IS_WANTED(i)) AT(list, 0)[at++] = i;
    else AT(list, 0)[other++] = -1;
}
