// Lights without a network: the radiance that arrives along rays. Radiance, directions, hits: {1, C, pixels, samples},
// samples fastest (kernels/lib/chunk.clh); image {n, 3, h, w}, linear; ambient {n, 3, 1, 1}.
#include "lib/chunk.clh"
#include "lib/lanes.clh"

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
  CHANNELS(c) AT(radiance, 0)[c * RAY_PLANE + ray] = at < 0 ? AT(ambient, n)[c] : AT(image, n)[c * w * h + at];
}

// The same where a hit is sure to 1 - u alone (as mix_light.cl has it): (1 - u) image + u ambient.
kernel void unsure_light(IN(image), IN(ambient), IN_INT(hit), IN(u), OUT(radiance), CHUNK_ARGS, const int items,
                         const int w, const int h) {
  SAMPLE_OF_WORK_ITEM
  const int at = AT(hit, 0)[ray];
  const real share = AT(u, 0)[ray];
  CHANNELS(c) {
    const real far = AT(ambient, n)[c];
    AT(radiance, 0)[c * RAY_PLANE + ray] =
        at < 0 ? far : (R(1) - share) * AT(image, n)[c * w * h + at] + share * far;
  }
}

// What of the gradient g goes to the image, or to the ambient.
kernel void unsure_share(IN(g), IN_INT(hit), IN(u), OUT(y), CHUNK_ARGS, const int ambient) {
  RAY_OF_WORK_ITEM
  const real far = AT(hit, 0)[ray] < 0 ? R(1) : AT(u, 0)[ray];
  const real share = ambient ? far : R(1) - far;
  CHANNELS(c) AT(y, 0)[c * RAY_PLANE + ray] = share * AT(g, 0)[c * RAY_PLANE + ray];
}

// The same radiance from everywhere.
kernel void constant_light(IN(ambient), OUT(radiance), CHUNK_ARGS, const int items, const int w, const int h) {
  SAMPLE_OF_WORK_ITEM
  CHANNELS(c) AT(radiance, 0)[c * RAY_PLANE + ray] = AT(ambient, n)[c];
}

// The transpose of the ambient: a row of rays sums what those of them bring that saw it, then each picture its rows,
// with Kahan's compensation in each lane. rows {1, 3, pixel_capacity, 1}. A work-group takes a row, or a picture
// (lib/lanes.clh).
#if LANES == 16
#define IS_MISS(p) convert_mask16(vload16(0, p) < 0)
#else
#define IS_MISS(p) (*(p) < 0)
#endif

kernel void miss_sums(IN(g), IN_INT(hit), OUT(rows), CHUNK_ARGS) {
  const int p = (int)get_group_id(0), c = (int)get_group_id(1);
  GROUP_SCRATCH(scratch);
  global const real *from = AT(g, 0) + (ulong)c * RAY_PLANE + RAY(p, 0);
  global const int *hits = AT(hit, 0) + RAY(p, 0);
  lanes sum = (lanes)(R(0));
  FOR_ROW(i, samples) sum += WHERE(IS_MISS(hits + i), lanes_load(from + i, samples - i), R(0));
  const real total = group_sum(sum, scratch);
  if (get_local_id(0) == 0) AT(rows, 0)[c * pixel_capacity + p] = total;
}

kernel void row_sums(IN(g), OUT(rows), CHUNK_ARGS) {
  const int p = (int)get_group_id(0), c = (int)get_group_id(1);
  GROUP_SCRATCH(scratch);
  global const real *from = AT(g, 0) + (ulong)c * RAY_PLANE + RAY(p, 0);
  lanes sum = (lanes)(R(0));
  FOR_ROW(i, samples) sum += lanes_load(from + i, samples - i);
  const real total = group_sum(sum, scratch);
  if (get_local_id(0) == 0) AT(rows, 0)[c * pixel_capacity + p] = total;
}

kernel void picture_sums(IN(rows), OUT(ambient), const int first_pixel, const int pixels, const int pixel_capacity,
                         const int items, const int plane) {
  const int n = (int)get_group_id(0), c = (int)get_group_id(1);
  GROUP_SCRATCH(scratch);
  const int begin = max(0, n * plane - first_pixel);
  const int count = (n == items - 1 ? pixels : min(pixels, (n + 1) * plane - first_pixel)) - begin;
  global const real *from = AT(rows, 0) + c * pixel_capacity + begin;
  lanes sum = (lanes)(R(0)), lost = (lanes)(R(0));
  FOR_ROW(i, count) {
    const lanes value = lanes_load(from + i, count - i) - lost, next = sum + value;
    lost = (next - sum) - value;
    sum = next;
  }
  const real total = group_sum(sum, scratch);
  if (get_local_id(0) == 0) AT(ambient, n)[c] = total;
}
