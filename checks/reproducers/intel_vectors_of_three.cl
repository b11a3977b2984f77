// device: Intel
// kernels: trace/path.cl
// Where the compiler vectorises a kernel and does not inline a function that takes a vector of three, the caller passes
// those of a vector's work-items three numbers apart and the function reads them four apart: item 1 gets (y, z) of its
// own and x of item 2. What such a function returns is shifted the other way. Here its first number should be i.
__attribute__((noinline)) static int first(float3 v) { return (int)v.x; }
kernel void reproduce(global int *wrong, const int many) {
  const int i = (int)get_global_id(0);
  wrong[i ^ 1] = first((float3)(i, i + 20, i + 40)) - i;
}
