// Screen-space ray tracing: the first cell of a depth map that a ray meets.
//
// A ray (origin, direction, camera metres) is clipped to z < -near and to the picture's frustum. What is left is a
// straight piece a -> b on the picture, over which x, y and the inverse depth k = -1/z are affine in s in [0, 1].
// Depth is a grid of constant cells. The border x = i lies at s = (i - a.x) / (b.x - a.x), rows alike; a cell is
// crossed over the interval between its borders when that is not empty, and is hit when somewhere in it the ray is at or behind
// the cell's depth (min k <= 1/depth), the cell is not the one to skip, faces the ray (FACING: direction . normal <= 0)
// and, with THICKNESS, the ray is not wholly deeper than depth + thickness. The hit is the first such cell.
// A ray walks cell by cell (DDA: the symmetric one of Amanatides and Woo 1987), or over blocks of the pyramid of
// largest inverse depths, down where it might meet something and up where not (after Uludag 2014, GPU Pro 5 ch. 4).
// Borders are those of cells either way and k is monotone in s, so both give the same cell to the last bit.
//
// Rays that leave a surface are behind its neighbours' cells, which face away from them, for as long as depth and normals
// disagree. So a block whose normals all face away from the ray is passed over like one that it does not meet (BOXES,
// normal_pyramid.cl), and one whose normals all face it needs no normal: the cell is the same to the last bit.
//
// A work-item takes PACKET samples of a pixel side by side (lib/packet.clh), each with its own level and place.
//
// Rays: {1, 3, pixels, samples}, samples fastest, a multiple of 16; a zero direction is no ray. Results, same layout:
// pixel y * w + x of the cell, or -1; delta: depth of the ray less that of the cell where the ray enters it behind the
// surface, else 0, over scene_scale (WINDOW: in window depth, (1 - n/z)/(1 - n), z over the largest depth, n the
// smallest); u = tanh(10 delta), 1 on a miss, 0 for no ray.
//
// Origins: the surface of the ray's own pixel, which it skips; or ORIGIN_MAP {n, 3, h, w}, ORIGIN_RAYS {1, 3, pixels,
// samples} with skip (a pixel or -1) in the same layout.
#include "lib/camera.clh"
#include "lib/chunk.clh"
#include "lib/packet.clh"
#pragma OPENCL FP_CONTRACT OFF

#define HUGE_SLOPE R(1e30)

// Cell by cell, a ray that crosses no border of an axis stays in its row or column; beyond a block it is looked up.
#ifdef DDA
#define FIRST_LEVEL 0
#define TOP_LEVEL 0
#define STAY(axis, cell) cell
#else
#define FIRST_LEVEL min(2, levels - 1)
#define TOP_LEVEL (levels - 1)
#define STAY(axis, cell) cell_at(axis, leave)
#ifdef FACING
#define BOXES
#endif
#endif

// The lesser of two, neither NaN.
static inline reals least(const reals a, const reals b) { return PICK(IS(a < b), a, b); }

// What of [t0, t1] satisfies f + t g >= 0.
static inline void clip(const reals f, const reals g, reals *t0, reals *t1) {
  const reals t = -f / g;
  *t0 = PICK(IS(g > R(0)) & IS(f < R(0)), fmax(*t0, t), *t0);
  *t1 = PICK(IS(g < R(0)), fmin(*t1, t), *t1);
  *t1 = PICK(IS(g == R(0)) & IS(f < R(0)), R(-1), *t1);
}

// One axis of the picture, turned so that the ray moves forward: a ray that moves backward is mirrored at 0, which is
// exact, and its cell i is then numbered ~i (so that blocks, i >> level, are complements too). flip is 0 or -1.
typedef struct {
  reals start, slope, reciprocal;
  reals half_cell;  // .5 in the sign of all positions on this axis: rounds to nearest where conversion cuts
  ints flip;
} Axis;

// A ray along the other axis never meets a border of this one: its reciprocal puts them beyond s = 1.
static inline Axis axis_of(const reals start, const reals end) {
  Axis a;
  const reals slope = end - start;
  a.flip = IS(slope < R(0));
  a.half_cell = PICK(a.flip, R(-0.5), R(0.5));
  a.start = PICK(a.flip, -start, start);
  a.slope = PICK(IS(fabs(slope) < R(1) / HUGE_SLOPE), R(0), fabs(slope));
  a.reciprocal = PICK(IS(a.slope == R(0)), HUGE_SLOPE, R(1) / a.slope);
  return a;
}

// Where the ray meets the border between the cells i - 1 and i.
static inline reals border(const Axis a, const ints i) { return (REALS(i) - a.start) * a.reciprocal; }

// The cell in which the ray is at s: border(i) <= s < border(i + 1). Rounding leaves only the nearest border in doubt.
static inline ints cell_at(const Axis a, const reals s) {
  const ints nearest = INTS(fma(s, a.slope, a.start) + a.half_cell);
  return nearest + IS(border(a, nearest) > s);
}

#ifdef BOXES
// The product of a direction and a packed corner of normal_pyramid.cl, more by that with 511 on every axis.
static inline reals dot_corner(const reals dx, const reals dy, const reals dz, const ints corner) {
  return dx * REALS(corner & 1023) + dy * REALS(corner >> 10 & 1023) + dz * REALS(corner >> 20);
}
#endif

kernel void ssrt(IN(pyramid), IN(camera), IN(range), IN(direction),
#if defined(ORIGIN_MAP) || defined(ORIGIN_RAYS)
                 IN(origin), IN_INT(skip),
#endif
#ifdef FACING
                 IN(normal), IN_INT(boxes),
#endif
                 OUT_INT(hit), OUT(delta), OUT(u), CHUNK_ARGS, const int items, const int w, const int h,
                 const int stride, const int level_rows, const int levels, const real thickness) {
  const int packet = (int)get_global_id(0);
  const int packets = (samples + PACKET - 1) / PACKET;
  const int p = packet / packets;
  if (p >= pixels) return;
  const ulong ray = RAY(p, (packet - p * packets) * PACKET);
  const int plane = w * h;
  const int n = min((first_pixel + p) / plane, items - 1);
  const Camera c = camera_at(AT(camera, n));
  global const real *cells = AT(pyramid, n);

  global const real *directions = AT(direction, 0) + ray;
  const reals dx = LOAD(directions), dy = LOAD(directions + RAY_PLANE), dz = LOAD(directions + 2 * RAY_PLANE);
#if defined(ORIGIN_RAYS)
  global const real *origins = AT(origin, 0) + ray;
  const reals ox = LOAD(origins), oy = LOAD(origins + RAY_PLANE), oz = LOAD(origins + 2 * RAY_PLANE);
  const ints skipped = LOAD(AT(skip, 0) + ray);
#elif defined(ORIGIN_MAP)
  const int own = first_pixel + p - n * plane;
  global const real *origins = AT(origin, n) + own;
  const reals ox = origins[0], oy = origins[plane], oz = origins[2 * plane];
  const ints skipped = AT(skip, n)[own];
#else
  const int own = first_pixel + p - n * plane;  // the ray's own pixel
  const int own_y = own / w, own_x = own - own_y * w;
  const real own_k = cells[own_y * stride + own_x];
  const real3 point = pixel_ray(c, own_x, own_y) / own_k;
  const reals ox = point.x, oy = point.y, oz = point.z;
  const ints skipped = own;
#endif

  // Clip in homogeneous coordinates, in which each side of the frustum is a plane: x = (cx m + fx X) / m, m = -z.
  const reals om = -oz, dm = -dz;
  reals t0 = R(0), t1 = R(REAL_MAX);
  clip(om - R(0.5) * AT(range, n)[1], dm, &t0, &t1);
  clip(c.cx * om + c.fx * ox, c.cx * dm + c.fx * dx, &t0, &t1);
  clip(((real)w - c.cx) * om - c.fx * ox, ((real)w - c.cx) * dm - c.fx * dx, &t0, &t1);
  clip(c.cy * om - c.fy * oy, c.cy * dm - c.fy * dy, &t0, &t1);
  clip(((real)h - c.cy) * om + c.fy * oy, ((real)h - c.cy) * dm + c.fy * dy, &t0, &t1);
  ints is_ray = IS(dx != R(0)) | IS(dy != R(0)) | IS(dz != R(0));
#if !defined(ORIGIN_RAYS) && !defined(ORIGIN_MAP)
  is_ray &= IS((reals)(own_k) > R(0));
#endif
  ints active = is_ray & IS(t0 < t1);

  // The two ends on the picture. A ray that goes to infinity ends in its vanishing point with k = 0.
  const ints endless = IS(t1 >= R(REAL_MAX));
  const reals am = om + t0 * dm;
  const reals bm = PICK(endless, dm, om + t1 * dm);
  const reals zero = R(0), right = (real)w, bottom = (real)h;
  const Axis x = axis_of(clamp(c.cx + c.fx * (ox + t0 * dx) / am, zero, right),
                         clamp(c.cx + c.fx * PICK(endless, dx, ox + t1 * dx) / bm, zero, right));
  const Axis y = axis_of(clamp(c.cy - c.fy * (oy + t0 * dy) / am, zero, bottom),
                         clamp(c.cy - c.fy * PICK(endless, dy, oy + t1 * dy) / bm, zero, bottom));
  const reals k0 = R(1) / am;
  const reals k_slope = PICK(endless, R(0), R(1) / bm) - k0;

  reals s = R(0), k_ray = R(1), k_hit = R(1);
  ints i = cell_at(x, s), j = cell_at(y, s);
  ints level = FIRST_LEVEL, found = -1;
#ifdef BOXES
  const ints backward = IS(dx <= R(0)) & 1023 | IS(dy <= R(0)) & 1023 << 10 | IS(dz <= R(0)) & 1023 << 20;
  const reals middle = R(511) * (dx + dy + dz);
#endif
  active &= IS(AS_UINTS(i ^ x.flip) < (uint)w) & IS(AS_UINTS(j ^ y.flip) < (uint)h);
  while (any_of(active)) {
    const ints block_i = i >> level, block_j = j >> level;
    const ints exit_i = (block_i + 1) << level, exit_j = (block_j + 1) << level;
    const reals sx = border(x, exit_i), sy = border(y, exit_j);
    const reals leave = least(least(sx, sy), R(1));
    const reals k_in = fma(s, k_slope, k0), k_out = fma(leave, k_slope, k0);
    const ints row = level_rows - ((ints)(level_rows) >> level) + (block_j ^ y.flip);
    const ints index = (row * stride + (block_i ^ x.flip)) & active;
    const reals k_cell = GATHER(cells, index);
    ints meets = active & IS(least(k_in, k_out) <= k_cell);
#ifdef BOXES
    // Of the block's box around its normals: the corner that comes closest to facing the ray, and the farthest from it.
    global const int *boxes_n = AT(boxes, n);
    const ints low = GATHER_INT(boxes_n, 2 * index), high = GATHER_INT(boxes_n + 1, 2 * index);
    meets &= IS(dot_corner(dx, dy, dz, low & ~backward | high & backward) <= middle);
    const ints doubtful = IS(dot_corner(dx, dy, dz, high & ~backward | low & backward) > middle);
#else
    const ints doubtful = -1;
#endif
    const ints leaf = meets & IS(level == 0);
    if (any_of(leaf)) {
      const ints cell = (j ^ y.flip) * w + (i ^ x.flip);
      ints hits = leaf & IS(cell != skipped);
#ifdef THICKNESS
      hits &= IS(fmax(k_in, k_out) * (R(1) + thickness * k_cell) >= k_cell);
#endif
#ifdef FACING
      const ints asked = hits & doubtful;
      if (any_of(asked)) {
        const ints at = cell & asked;
        global const real *nx = AT(normal, n), *ny = nx + plane, *nz = ny + plane;
        hits &= ~asked | IS(dx * GATHER(nx, at) + dy * GATHER(ny, at) + dz * GATHER(nz, at) <= R(0));
      }
#endif
      found = PICK_INT(hits, cell, found);
      k_ray = PICK(hits, k_in, k_ray);
      k_hit = PICK(hits, k_cell, k_hit);
      active &= ~hits;
    }
    // Down into a block that may be met; else on to the cell beyond it, one level up, but not from a cell that was
    // met and refused: behind a surface that faces away the next is likely to be refused as well.
    const ints down = meets & IS(level > 0);
    const ints on = active & ~down;
    i = PICK_INT(on, PICK_INT(IS(sx <= leave), exit_i, STAY(x, i)), i);
    j = PICK_INT(on, PICK_INT(IS(sy <= leave), exit_j, STAY(y, j)), j);
    s = PICK(on, leave, s);
    level = PICK_INT(on, min(level + 1 + meets, TOP_LEVEL), level + down);
    active &= IS(s < R(1)) & IS(AS_UINTS(i ^ x.flip) < (uint)w) & IS(AS_UINTS(j ^ y.flip) < (uint)h);
  }
#ifdef WINDOW
  const real nearest = AT(range, n)[1], span = R(1) - nearest / AT(range, n)[2];
  const reals behind = span > R(0) ? nearest * (k_hit - k_ray) / span : (reals)(R(0));  // one depth has no window
#else
  const reals behind = (R(1) / k_ray - R(1) / k_hit) / AT(range, n)[0];
#endif
  const reals gap = fmax(behind, R(0));
  STORE(found, AT(hit, 0) + ray);
  STORE(gap, AT(delta, 0) + ray);
  STORE(PICK(is_ray, PICK(IS(found < 0), R(1), tanh(R(10) * gap)), R(0)), AT(u, 0) + ray);
}
