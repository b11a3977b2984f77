// What a photograph shows where a material is replaced (experiments/applications/edit.cpp).
//
// All {1, C, h, w}: photo 3; old_albedo, old_material, albedo, material 3 each, of before and after; emitted 1, 1 where
// the surface was an emitter; shown 1, 1 where the new material is shown; old_specular, specular 3 each, the layer's
// specular parts of before and after; whole 3, the layer's picture of after with both parts.
// Specular: what the layer finds. Diffuse: the photograph less its old specular part times the ratio k of diffuse
// albedos; where k is too large to be trusted, of the grey light that fits its three channels best; where that is too,
// and for what emitted, the layer's own.
#include "lib/real.clh"

// The photograph's diffuse light is multiplied by this at most: dividing by a dark albedo blows up its noise and the
// errors of the maps.
#define MOST_GAIN R(4)
// Below this an albedo is black: ratios to it and squares of it stay finite in float.
#define BLACK R(1e-12)

// Shares of the photograph's own diffuse part of a channel times k, of the grey light times the new albedo, and of the
// layer's diffuse part.
typedef struct {
  real k, now, channel, grey, layer;
} source;

// The share that a source keeps at a gain: beyond the largest one it falls faster than the gain grows.
static inline real trusted(const real gain) {
  const real over = MOST_GAIN / gain;
  return gain > MOST_GAIN ? over * over : R(1);
}

// Of a channel whose diffuse albedo was `old` and is `now`; `squares`: the sum of the old ones' over three channels.
static inline source source_of(const real old, const real now, const real squares, const int emitted) {
  source s;
  s.now = now, s.k = R(0), s.channel = R(1), s.grey = s.layer = R(0);
  if (now == R(0)) return s;
  s.k = old > BLACK ? now / old : R(0);
  s.channel = emitted || old <= BLACK ? R(0) : trusted(s.k);
  const real grey = emitted || squares == R(0) ? R(0) : trusted(now / sqrt(squares / R(3)));
  s.grey = (R(1) - s.channel) * grey, s.layer = (R(1) - s.channel) * (R(1) - grey);
  return s;
}

#define DIFFUSE(albedo, material, c) \
  (AT(albedo, 0)[(ulong)(c) * plane + i] * (R(1) - AT(material, 0)[(ulong)plane + i]))

static inline real sum_of_squares(const real a, const real b, const real c) { return a * a + b * b + c * c; }

// What the pixel shows less the photograph; 0 where `shown` is not set.
kernel void repaint(IN(photo), IN(old_albedo), IN(old_material), IN(albedo), IN(material), IN(emitted), IN(shown),
                    IN(old_specular), IN(specular), IN(whole), OUT(change), const int plane) {
  const int i = (int)get_global_id(0);
  if (i >= plane) return;
  real old[3], left[3], products = R(0);
  for (int c = 0; c < 3; ++c) {
    const ulong at = (ulong)c * plane + i;
    old[c] = DIFFUSE(old_albedo, old_material, c);
    left[c] = AT(photo, 0)[at] - AT(old_specular, 0)[at];
    products += old[c] * fmax(left[c], R(0));
  }
  const real squares = sum_of_squares(old[0], old[1], old[2]);
  // Irradiance over pi if it were grey: least squares of albedo times it to the photograph's diffuse part.
  const real grey = squares > R(0) ? products / squares : R(0);
  const int is_shown = AT(shown, 0)[i] != R(0), was_lamp = AT(emitted, 0)[i] != R(0);
  for (int c = 0; c < 3; ++c) {
    const ulong at = (ulong)c * plane + i;
    const real now = AT(specular, 0)[at];
    const source s = source_of(old[c], DIFFUSE(albedo, material, c), squares, was_lamp);
    // Where the layer's specular part is more than all that the photograph shows, the new one is less by as much.
    const real excess = fmin(fmax(-left[c], R(0)), now);
    const real diffuse = s.channel * s.k * fmax(left[c], R(0)) + s.grey * s.now * grey +
                         s.layer * fmax(AT(whole, 0)[at] - now, R(0));
    AT(change, 0)[at] = is_shown ? now - excess + diffuse - AT(photo, 0)[at] : R(0);
  }
}

// The largest share of a pixel's channels that is the layer's to say, {1, 1, h, w}: where it is 0, repaint() does not
// read `whole`.
kernel void repaint_layer_share(IN(old_albedo), IN(old_material), IN(albedo), IN(material), IN(emitted), OUT(share),
                                const int plane) {
  const int i = (int)get_global_id(0);
  if (i >= plane) return;
  real old[3], most = R(0);
  for (int c = 0; c < 3; ++c) old[c] = DIFFUSE(old_albedo, old_material, c);
  const real squares = sum_of_squares(old[0], old[1], old[2]);
  for (int c = 0; c < 3; ++c)
    most = fmax(most,
                source_of(old[c], DIFFUSE(albedo, material, c), squares, AT(emitted, 0)[i] != R(0)).layer);
  AT(share, 0)[i] = most;
}
