// Light as K spherical Gaussians a pixel (Li et al. 2020, CVPR): along a unit direction l
//   L(l) = sum_k w_k exp(lambda_k (xi_k . l - 1)),   xi_k . l - 1 = -|xi_k - l|^2 / 2,
// the right form of which keeps its digits where a sharp lobe is looked into, and is what is computed and differentiated.
//
// Lobes in {C, H, W} order: axis 3 K (lobe k, component c: channel 3 k + c; unit), sharpness K >= 0, weight 3 K. Rays
// {1, C, P, S} (kernels/lib/chunk.clh): direction 3, (0, 0, 0): none, and 0 arrives.
// Whose lobes a ray sees: by default its own, axis {1, 3 K, P, S}; ROW_LOBES: those of its row, {1, 3 K, P, 1}. of_points:
// those of the cell of a map {1, 3 K, h, w} that its point is seen in.
// A work-group takes a row of rays (lib/lanes.clh).
#include "lib/camera.clh"
#include "lib/chunk.clh"
#include "lib/lanes.clh"
#include "lib/li2020.clh"
#include "lib/surface.clh"

// Least exponent that counts, 4e-18 of a lobe's weight. An exponent rounds in parts of itself, so that what is less has
// fewer digits still, and would soon be subnormal, where a CPU takes some hundred cycles for a product.
#define LEAST_EXPONENT R(-40)

static inline lanes_mask is_ray(const Lanes3 d) {
  return d.c[0] * d.c[0] + d.c[1] * d.c[1] + d.c[2] * d.c[2] > R(0);
}

// A NaN stays one.
static inline lanes shape_of(const lanes exponent) {
  const lanes shape = exp(WHERE(exponent < LEAST_EXPONENT, R(LEAST_EXPONENT), exponent));
  return WHERE(exponent <= LEAST_EXPONENT, R(0), shape);
}

#ifdef ROW_LOBES
typedef real Number;  // one for all lanes
#define LOBE_PLANE ((ulong)pixel_capacity)
#define LOBE_NUMBER(t, channel, s) AT(t, 0)[(ulong)(channel)*LOBE_PLANE + (ulong)p]
#else
typedef lanes Number;
#define LOBE_PLANE RAY_PLANE
#define LOBE_NUMBER(t, channel, s) lanes_load(AT(t, 0) + (ulong)(channel)*LOBE_PLANE + RAY(p, s), sample_capacity - (s))
#endif

kernel void spherical_gaussians(IN(axis), IN(sharpness), IN(weight), IN(direction), OUT(y), CHUNK_ARGS,
                                const int lobes) {
  const int p = (int)get_group_id(0);
  FOR_ROW(s, sample_capacity) {
    const int left = sample_capacity - s;
    const Lanes3 d = lanes3_load(AT(direction, 0) + RAY(p, s), RAY_PLANE, left);
    lanes sum[3] = {R(0), R(0), R(0)};
    for (int k = 0; k < lobes; ++k) {
      lanes square = R(0);
      CHANNELS(c) {
        const lanes apart = LOBE_NUMBER(axis, 3 * k + c, s) - d.c[c];
        square += apart * apart;
      }
      const lanes shape = shape_of(R(-0.5) * LOBE_NUMBER(sharpness, k, s) * square);
      CHANNELS(c) sum[c] += LOBE_NUMBER(weight, 3 * k + c, s) * shape;
    }
    CHANNELS(c) lanes_store(WHERE(is_ray(d), sum[c], R(0)), AT(y, 0) + c * RAY_PLANE + RAY(p, s), left);
  }
}

// Adjoints from g {1, 3, P, S}. With a = xi - l and t = sum_c g_c w_c exp(..): to weight g exp(..), to sharpness -t |a|^2 / 2,
// to the axis -t lambda a; with ROW_LOBES summed over the row. To the direction the sum over lobes of t lambda a.
typedef struct {
  lanes apart[3], square, shape, charge;  // charge: t
  Number sharpness;
} SeenLobe;

#define SEE_LOBE(seen, k, s)                                                     \
  seen.square = R(0), seen.charge = R(0);                                        \
  CHANNELS(c) {                                                                  \
    seen.apart[c] = LOBE_NUMBER(axis, 3 * (k) + c, s) - d.c[c];                  \
    seen.square += seen.apart[c] * seen.apart[c];                                \
  }                                                                              \
  seen.sharpness = LOBE_NUMBER(sharpness, k, s);                                 \
  seen.shape = shape_of(R(-0.5) * seen.sharpness * seen.square);                 \
  CHANNELS(c) seen.charge += from.c[c] * LOBE_NUMBER(weight, 3 * (k) + c, s);    \
  seen.charge *= seen.shape;

#define RAY_AND_GRADIENT(s)                                                              \
  const int left = sample_capacity - (s);                                                \
  const Lanes3 d = lanes3_load(AT(direction, 0) + RAY(p, s), RAY_PLANE, left);                 \
  Lanes3 from = lanes3_load(AT(g, 0) + RAY(p, s), RAY_PLANE, left);                            \
  CHANNELS(c) from.c[c] = lanes_inside(WHERE(is_ray(d), from.c[c], R(0)), samples - (s));

kernel void spherical_gaussians_to_direction(IN(axis), IN(sharpness), IN(weight), IN(direction), IN(g),
                                             OUT(d_direction), CHUNK_ARGS, const int lobes) {
  const int p = (int)get_group_id(0);
  FOR_ROW(s, sample_capacity) {
    RAY_AND_GRADIENT(s)
    lanes to[3] = {R(0), R(0), R(0)};
    for (int k = 0; k < lobes; ++k) {
      SeenLobe seen;
      SEE_LOBE(seen, k, s)
      CHANNELS(c) to[c] += seen.charge * seen.sharpness * seen.apart[c];
    }
    CHANNELS(c) lanes_store(to[c], AT(d_direction, 0) + c * RAY_PLANE + RAY(p, s), left);
  }
}

// A group takes one lobe of a row.
kernel void spherical_gaussians_to_lobes(IN(axis), IN(sharpness), IN(weight), IN(direction), IN(g), OUT(d_axis),
                                         OUT(d_sharpness), OUT(d_weight), CHUNK_ARGS, const int lobes) {
  const int p = (int)get_group_id(0), k = (int)get_group_id(1);
#ifdef ROW_LOBES
  GROUP_SCRATCH(scratch);
  lanes to_axis[3] = {R(0), R(0), R(0)}, to_weight[3] = {R(0), R(0), R(0)}, to_sharpness = R(0);
  FOR_ROW(s, samples) {
    RAY_AND_GRADIENT(s)
    SeenLobe seen;
    SEE_LOBE(seen, k, s)
    to_sharpness += seen.charge * seen.square;
    CHANNELS(c) {
      to_axis[c] += seen.charge * seen.apart[c];
      to_weight[c] += from.c[c] * seen.shape;
    }
  }
  const real own = AT(sharpness, 0)[(ulong)k * LOBE_PLANE + (ulong)p];
  const real square = group_sum(to_sharpness, scratch);
  real axes[3], weights[3];
  CHANNELS(c) axes[c] = group_sum(to_axis[c], scratch), weights[c] = group_sum(to_weight[c], scratch);
  if (get_local_id(0) > 0) return;
  AT(d_sharpness, 0)[(ulong)k * LOBE_PLANE + (ulong)p] = R(-0.5) * square;
  CHANNELS(c) {
    AT(d_axis, 0)[(ulong)(3 * k + c) * LOBE_PLANE + (ulong)p] = -own * axes[c];
    AT(d_weight, 0)[(ulong)(3 * k + c) * LOBE_PLANE + (ulong)p] = weights[c];
  }
#else
  FOR_ROW(s, sample_capacity) {
    RAY_AND_GRADIENT(s)
    SeenLobe seen;
    SEE_LOBE(seen, k, s)
    lanes_store(R(-0.5) * seen.charge * seen.square, AT(d_sharpness, 0) + k * LOBE_PLANE + RAY(p, s), left);
    CHANNELS(c) {
      lanes_store(-seen.sharpness * seen.charge * seen.apart[c], AT(d_axis, 0) + (3 * k + c) * LOBE_PLANE + RAY(p, s),
                  left);
      lanes_store(from.c[c] * seen.shape, AT(d_weight, 0) + (3 * k + c) * LOBE_PLANE + RAY(p, s), left);
    }
  }
#endif
}

// A grid over a picture: w x h cells, picture_w x picture_h pixels.
#define GRID_ARGS const int w, const int h, const int picture_w, const int picture_h

// The cell that a point is seen in; of points beside the picture one of its edge, of those behind the camera that on the
// point's side. One of the grid whatever the numbers are. camera: of the picture.
static inline int cell_seen(const Camera camera, const real3 point, GRID_ARGS) {
  const real z = point.z < R(-1e-6) ? point.z : R(-1e-6);
  const real2 at = project(camera, (real3)(point.x, point.y, z));
  const real x = at.x * (real)w / (real)picture_w, y = at.y * (real)h / (real)picture_h;
  const int i = (int)fmin(fmax(x, R(0)), (real)(w - 1)), j = (int)fmin(fmax(y, R(0)), (real)(h - 1));
  return j * w + i;
}

// Cells of points {1, 3, P, S}: Int {1, 1, P, S}, -1 for samples beyond the chunk's.
kernel void point_cells(IN(points), IN(camera), OUT_INT(cell), CHUNK_ARGS, GRID_ARGS) {
  RAY_OF_WORK_ITEM
  global const real *from = AT(points, 0) + ray;
  const real3 point = (real3)(from[0], from[RAY_PLANE], from[2 * RAY_PLANE]);
  AT(cell, 0)[ray] = s < samples ? cell_seen(camera_at(AT(camera, 0)), point, w, h, picture_w, picture_h) : -1;
}

#ifndef ROW_STARTS
static inline lanes gathered(global const real *v, const int *cells) {
  real part[LANES];
  for (int l = 0; l < LANES; ++l) part[l] = v[cells[l]];
#if LANES == 16
  return vload16(0, part);
#else
  return part[0];
#endif
}
#endif

// The same light at points {1, 3, P, S}, or with ROW_STARTS {1, 3, P, 1}: from lobes in maps {1, ., h, w}, by the cell that
// a point is seen in. camera {1, 4, 1, 1}.
kernel void gaussians_of_points(IN(axis), IN(sharpness), IN(weight), IN(camera), IN(points), IN(direction), OUT(y),
                                CHUNK_ARGS, const int lobes, GRID_ARGS) {
  const int p = (int)get_group_id(0);
  const Camera camera = camera_at(AT(camera, 0));
  const ulong plane = (ulong)w * (ulong)h;
#ifdef ROW_STARTS
  global const real *from = AT(points, 0) + p;
  const int cell =
      cell_seen(camera, (real3)(from[0], from[pixel_capacity], from[2 * pixel_capacity]), w, h, picture_w,
                picture_h);
#define MAP_NUMBER(t, channel) AT(t, 0)[(ulong)(channel)*plane + (ulong)cell]
#else
#define MAP_NUMBER(t, channel) gathered(AT(t, 0) + (ulong)(channel)*plane, cells)
#endif
  FOR_ROW(s, sample_capacity) {
    const int left = sample_capacity - s;
    const Lanes3 d = lanes3_load(AT(direction, 0) + RAY(p, s), RAY_PLANE, left);
#ifndef ROW_STARTS
    int cells[LANES];
    for (int l = 0; l < LANES; ++l) {
      global const real *from = AT(points, 0) + RAY(p, s + min(l, left - 1));
      cells[l] = cell_seen(camera, (real3)(from[0], from[RAY_PLANE], from[2 * RAY_PLANE]), w, h, picture_w,
                           picture_h);
    }
#endif
    lanes sum[3] = {R(0), R(0), R(0)};
    for (int k = 0; k < lobes; ++k) {
      lanes square = R(0);
      CHANNELS(c) {
        const lanes apart = MAP_NUMBER(axis, 3 * k + c) - d.c[c];
        square += apart * apart;
      }
      const lanes shape = shape_of(R(-0.5) * MAP_NUMBER(sharpness, k) * square);
      CHANNELS(c) sum[c] += MAP_NUMBER(weight, 3 * k + c) * shape;
    }
    CHANNELS(c) lanes_store(WHERE(is_ray(d), sum[c], R(0)), AT(y, 0) + c * RAY_PLANE + RAY(p, s), left);
  }
}

// Axes {n, 3 K, h, w} from the hemisphere's frame at each pixel (lib/li2020.clh, of the normal {n, 3, h, w}, of any length)
// to the camera's, or `back`: the transpose.
kernel void turn_gaussians(IN(axis), IN(normal), OUT(y), const int lobes, const int plane, const int back) {
  const int i = (int)get_global_id(0), n = (int)get_global_id(1);
  if (i >= plane) return;
  const real3 mapped = rgb_at(AT(normal, n), plane, i);
  const Frame frame = grid_frame(unit3(mapped / unit_near(mapped)));
  for (int k = 0; k < lobes; ++k) {
    const real3 v = rgb_at(AT(axis, n) + (ulong)(3 * k) * plane, plane, i);
    const real3 turned = back ? to_local(frame, v) : to_world(frame, v);
    global real *to = AT(y, n) + (ulong)(3 * k) * plane + i;
    to[0] = turned.x, to[plane] = turned.y, to[2 * plane] = turned.z;
  }
}
