// A photograph with objects put into it, from what passes over the picture gave (experiments/applications/insert.cpp).
//
// All {1, C, h, w}: photo 3; objects 3, radiance that objects show, times their share of a pixel; covers 1, that share;
// change 3, what the objects change on the rest of it, as the layer has it; without 3, the layer's own picture of the
// room without them (0: not asked); emits 1.
// The rest of a pixel is the photograph + the change by the photograph's measure: times photo / without, so that a
// shadow takes the share of light that it covers, whatever the maps and the light are wrong by. What objects add is
// never made more, for where the layer is far too dark that would be noise. A lamp's own light is not scaled. A change
// that is faint beside the photograph is added as it is, a plain one by the measure, and between them it grows. What
// objects take is plain as well where it is plain beside the layer: one that is twenty times too dark still casts its
// shadow. (A hundred times: the change is faint, and then the layer is not asked.)
#include "lib/real.clh"

// Shares of the photograph, or of the layer.
#define FAINT R(0.0078125)
#define PLAIN R(0.03125)

static inline real plainness_of(const real change, const real beside) {
  return clamp((fabs(change) / fmax(beside, R(1e-6)) - FAINT) / (PLAIN - FAINT), R(0), R(1));
}

kernel void insertion(IN(photo), IN(objects), IN(covers), IN(change), IN(without), IN(emits), OUT(composite),
                      const int plane) {
  const int i = (int)get_global_id(0);
  const int c = (int)get_global_id(1);
  if (i >= plane) return;
  const ulong at = (ulong)c * plane + i;
  const real seen = AT(photo, 0)[at], d = AT(change, 0)[at], layer = AT(without, 0)[at];
  real gain = layer > R(0) && AT(emits, 0)[i] == R(0) ? seen / layer : R(1);
  if (d > R(0)) gain = fmin(gain, R(1));
  const real beside = d < R(0) && layer > R(0) ? fmin(layer, seen) : seen;
  gain = R(1) + plainness_of(d, beside) * (gain - R(1));
  const real room = fmax(seen + gain * d, R(0));
  AT(composite, 0)[at] = AT(objects, 0)[at] + (R(1) - AT(covers, 0)[i]) * room;
}
