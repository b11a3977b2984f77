// Lights without a network: the radiance that arrives along rays. Radiance, directions, hits: {1, C, pixels, samples},
// samples fastest (kernels/lib/chunk.clh); image {n, 3, h, w}, linear; ambient {n, 3, 1, 1}.
#include "lib/chunk.clh"

#define SAMPLE_OF_WORK_ITEM                                  \
  const int s = (int)get_global_id(0);                       \
  const int p = (int)get_global_id(1);                       \
  if (s >= samples || p >= pixels) return;                   \
  const int n = min((first_pixel + p) / (w * h), items - 1); \
  const ulong ray = RAY(p, s);

// The photograph's radiance at the pixel that a ray hits, ambient on a miss. hit: pixel y * w + x, or -1.
kernel void image_light(IN(image), IN(ambient), IN_INT(hit), OUT(radiance), CHUNK_ARGS, const int items, const int w,
                        const int h) {
  SAMPLE_OF_WORK_ITEM
  const int at = AT(hit, 0)[ray];
  for (int c = 0; c < 3; ++c)
    AT(radiance, 0)[c * RAY_PLANE + ray] = at < 0 ? AT(ambient, n)[c] : AT(image, n)[c * w * h + at];
}

// The same radiance from everywhere.
kernel void constant_light(IN(ambient), OUT(radiance), CHUNK_ARGS, const int items, const int w, const int h) {
  SAMPLE_OF_WORK_ITEM
  for (int c = 0; c < 3; ++c) AT(radiance, 0)[c * RAY_PLANE + ray] = AT(ambient, n)[c];
}

// The transpose of the ambient: a row of rays sums what those of them bring that saw it, then each picture its rows,
// with Kahan's compensation. rows {1, 3, pixel_capacity, 1}.
kernel void miss_sums(IN(g), IN_INT(hit), OUT(rows), CHUNK_ARGS) {
  const int p = (int)get_global_id(0);
  const int c = (int)get_global_id(1);
  if (p >= pixels) return;
  global const real *from = AT(g, 0) + (ulong)c * RAY_PLANE;
  real sum = R(0);
  for (int s = 0; s < samples; ++s) sum += AT(hit, 0)[RAY(p, s)] < 0 ? from[RAY(p, s)] : R(0);
  AT(rows, 0)[c * pixel_capacity + p] = sum;
}

kernel void row_sums(IN(g), OUT(rows), CHUNK_ARGS) {
  const int p = (int)get_global_id(0);
  const int c = (int)get_global_id(1);
  if (p >= pixels) return;
  global const real *from = AT(g, 0) + (ulong)c * RAY_PLANE;
  real sum = R(0);
  for (int s = 0; s < samples; ++s) sum += from[RAY(p, s)];
  AT(rows, 0)[c * pixel_capacity + p] = sum;
}

kernel void picture_sums(IN(rows), OUT(ambient), const int first_pixel, const int pixels, const int pixel_capacity,
                         const int items, const int plane) {
  const int n = (int)get_global_id(0);
  const int c = (int)get_global_id(1);
  if (n >= items) return;
  const int end = n == items - 1 ? pixels : min(pixels, (n + 1) * plane - first_pixel);
  real sum = R(0), lost = R(0);
  for (int p = max(0, n * plane - first_pixel); p < end; ++p) {
    const real value = AT(rows, 0)[c * pixel_capacity + p] - lost, next = sum + value;
    lost = (next - sum) - value;
    sum = next;
  }
  AT(ambient, n)[c] = sum;
}
