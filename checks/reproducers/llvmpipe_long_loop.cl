// device: llvmpipe
// kernels: all
// A loop of more than 65,535 rounds ends before its time: sums over many terms lack the rest. `many` is 70,001.
kernel void reproduce(global int *wrong, const int many) {
  int rounds = 0;
  for (int i = 0; i < many; ++i) rounds += 1 + (wrong[get_global_id(0)] & 0);
  wrong[get_global_id(0)] = many - rounds;
}
