// Rays in the order of the pixels that they hit, so that what they bring can be summed pixel by pixel without atomics on
// real numbers: a stable radix sort, digits of eight bits from the lowest up (Satish et al. 2009, IPDPS, in blocks of
// fixed length). Rays of one pixel keep their own order: same bits run to run, on any device.
//
// hit Int {1, 1, pixels, samples}: pixel y * w + x of the ray's own picture, or -1; key = picture * plane + hit, `keys` for
// misses and rays beyond the chunk. Rows beyond the pictures' planes are of the last picture, as for gather_rays. order:
// ray numbers p * samples + s of the whole tile. counts {digits, blocks}.
#include "lib/chunk.clh"
#include "lib/scan.clh"

#define DIGITS 256
#define DIGIT(key) (((key) >> shift) & (DIGITS - 1))
#define FOR_DIGITS(d) for (int d = (int)get_local_id(0); d < DIGITS; d += GROUP)
#if GROUP == 1
#define COUNT_ONE(p) (++*(p))
#else
#define COUNT_ONE(p) atomic_inc(p)
#endif

kernel void ray_keys(IN_INT(hit), OUT_INT(key), OUT_INT(order), CHUNK_ARGS, const int plane, const int keys) {
  const int s = (int)get_global_id(0);
  const int p = (int)get_global_id(1);
  if (s >= sample_capacity || p >= pixel_capacity) return;
  const ulong ray = RAY(p, s);
  const int pixel = AT(hit, 0)[ray], first = min((first_pixel + p) / plane, keys / plane - 1) * plane;
  const int inside = p < pixels && s < samples && pixel >= 0 && first + pixel < keys;
  AT(key, 0)[ray] = inside ? first + pixel : keys;
  AT(order, 0)[ray] = (int)ray;
}

// How often each digit is met in a block of `length` rays; one work-group per block (lib/lanes.clh).
kernel void count_digits(IN_INT(key), OUT_INT(counts), const int rays, const int length, const int blocks,
                         const int shift) {
  local int met[DIGITS];
  const int b = (int)get_group_id(0), end = min((b + 1) * length, rays);
  FOR_DIGITS(d) met[d] = 0;
  GROUP_BARRIER;
  for (int i = b * length + (int)get_local_id(0); i < end; i += GROUP) COUNT_ONE(met + DIGIT(AT(key, 0)[i]));
  GROUP_BARRIER;
  FOR_DIGITS(d) AT(counts, 0)[d * blocks + b] = met[d];
}

// counts become where each block's share of each digit begins. One work-group.
kernel void begin_digits(OUT_INT(counts), const int total) {
  local int sums[GROUP];
  scan_exclusive(AT(counts, 0), total, sums);
}

// One pass: a block puts its rays behind those of lower digits and of earlier blocks, as many at a time as the group has
// items: behind those of the same digit among items before.
kernel void place_by_digit(IN_INT(key), IN_INT(order), IN_INT(counts), OUT_INT(to_key), OUT_INT(to_order), const int rays,
                           const int length, const int blocks, const int shift) {
  local int next[DIGITS], digits[GROUP];
  const int b = (int)get_group_id(0), item = (int)get_local_id(0), end = min((b + 1) * length, rays);
  FOR_DIGITS(d) next[d] = AT(counts, 0)[d * blocks + b];
  for (int first = b * length; first < end; first += GROUP) {
    const int i = first + item, value = i < end ? AT(key, 0)[i] : 0, digit = i < end ? DIGIT(value) : DIGITS;
    int before = 0, all = 1;
#if GROUP > 1
    digits[item] = digit;
    GROUP_BARRIER;
    all = 0;
    for (int k = 0; k < GROUP; ++k) {
      const int same = digits[k] == digit;
      all += same;
      before += same & (k < item);
    }
#endif
    if (i < end) {
      const int at = next[digit] + before;
      AT(to_key, 0)[at] = value;
      AT(to_order, 0)[at] = AT(order, 0)[i];
    }
    GROUP_BARRIER;
    if (i < end && before == all - 1) next[digit] += all;
    GROUP_BARRIER;
  }
}

// starts {keys + 1}: where the rays of each key begin in the order; the last is where misses begin.
kernel void segment_starts(IN_INT(key), OUT_INT(starts), const int rays, const int keys) {
  const int k = (int)get_global_id(0);
  if (k > keys) return;
  int low = 0, high = rays;
  while (low < high) {
    const int middle = (low + high) >> 1;
    if (AT(key, 0)[middle] < k) low = middle + 1;
    else high = middle;
  }
  AT(starts, 0)[k] = low;
}
