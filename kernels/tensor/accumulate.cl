// Sum of two tensors, y = a + b: how gradients of several consumers meet. y may be a or b.
#include "lib/real.clh"

kernel void accumulate(IN(a), IN(b), OUT(y), const int item) {
  const int i = (int)get_global_id(0);
  const int n = (int)get_global_id(1);
  if (i < item) AT(y, n)[i] = AT(a, n)[i] + AT(b, n)[i];
}
