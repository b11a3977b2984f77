// How the chunks of map_chunks meet the whole picture.
// A picture of `batch` items has pixels 0 .. batch * plane - 1 in row-major order; a chunk holds a run of them.
#include "lib/real.clh"

#define PUT 0
#define ADD 1
#define KEEP 2  // what is there, unless it is 0

// whole[n, c, pixel] = tile[c, p], by one of these rules, for p < pixels, pixel = first + p.
// tile: {1, C, capacity, 1}; whole: {batch, C, h, w}, plane = h * w.
kernel void place(IN(tile), OUT(whole), const int first, const int pixels, const int capacity, const int plane,
                  const int rule) {
  const int p = (int)get_global_id(0);
  const int c = (int)get_global_id(1);
  if (p >= pixels) return;
  const int n = (first + p) / plane;
  const int pixel = (first + p) - n * plane;
  const real value = AT(tile, 0)[c * capacity + p];
  global real *to = AT(whole, n) + (ulong)c * (ulong)plane + pixel;
  *to = rule == PUT || (rule == KEEP && *to == R(0)) ? value : rule == ADD ? *to + value : *to;
}

// total += part, elementwise; both contiguous.
kernel void add_total(IN(part), OUT(total), const int count, const int add) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const real value = AT(part, 0)[i];
  AT(total, 0)[i] = add ? AT(total, 0)[i] + value : value;
}

// The same for integers, modulo 2^32.
kernel void add_total_int(IN_INT(part), OUT_INT(total), const int count, const int add) {
  const int i = (int)get_global_id(0);
  if (i >= count) return;
  const uint value = (uint)AT(part, 0)[i];
  AT(total, 0)[i] = (int)(add ? (uint)AT(total, 0)[i] + value : value);
}

// tile[c, p] = whole[n, c, pixel] for p < pixels, 0 beyond.
kernel void take(IN(whole), OUT(tile), const int first, const int pixels, const int capacity, const int plane) {
  const int p = (int)get_global_id(0);
  const int c = (int)get_global_id(1);
  if (p >= capacity) return;
  const int clamped = min(p, pixels - 1);
  const int n = (first + clamped) / plane;
  const int pixel = (first + clamped) - n * plane;
  AT(tile, 0)[c * capacity + p] = p < pixels ? AT(whole, n)[(ulong)c * (ulong)plane + pixel] : R(0);
}

// whole[n, c, pixel] = tile[c, p] inside the chunk, 0 elsewhere: the transpose of take. One launch per batch item n.
kernel void put(IN(tile), OUT(whole), const int n, const int first, const int pixels, const int capacity,
                const int plane) {
  const int pixel = (int)get_global_id(0);
  const int c = (int)get_global_id(1);
  if (pixel >= plane) return;
  const int p = n * plane + pixel - first;
  const int inside = p >= 0 && p < pixels;
  AT(whole, n)[(ulong)c * (ulong)plane + pixel] = inside ? AT(tile, 0)[c * capacity + clamp(p, 0, capacity - 1)] : R(0);
}
