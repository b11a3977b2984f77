// Embree on a triangulated depth map: what ssrt_embree.py compiles and runs beside `clerestory bench ssrt`.
//   ssrt_embree SCENE THREADS RUNS ISA [WAY]
// SCENE: ints width, height, rays; floats fx, fy, cx, cy; depth {h, w}, axial metres, 0 none; ints pixel {rays}; floats
// direction {rays, 3}, the camera's frame (x right, y up, looking along -z). Vertices are the points at pixels'
// centres, two triangles between four that are there. A ray starts at its pixel's point and hits nothing in the first
// thousandth of that depth, which is half a pixel. ISA: most that Embree may use ("avx2"; "": all). Each way of calling
// that this CPU has natively prints "WAY hit-rate seconds seconds ..."; building of triangles and their tree is not in
// them, filling of packets and taking hits out is, as ours reads directions and writes hits.
#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr int kBlock = 4096;  // rays that a thread takes at once; a multiple of every packet
constexpr float kFirst = 1e-3f;

struct Input {
  int width = 0, height = 0, rays = 0;
  float camera[4];
  std::vector<float> depth, direction;
  std::vector<int> pixel;

  void point(int at, float* to) const {
    const float z = depth[at];
    to[0] = z * (at % width + 0.5f - camera[2]) / camera[0];
    to[1] = z * (camera[3] - (at / width + 0.5f)) / camera[1];
    to[2] = -z;
  }
};

template <class T>
void read(std::ifstream& file, T* to, std::size_t count) {
  file.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count * sizeof(T)));
  if (!file) std::fprintf(stderr, "ssrt_embree: the scene ends too early\n"), std::exit(2);
}

Input read_input(const char* path) {
  std::ifstream file(path, std::ios::binary);
  Input in;
  read(file, &in.width, 1), read(file, &in.height, 1), read(file, &in.rays, 1), read(file, in.camera, 4);
  const std::size_t plane = static_cast<std::size_t>(in.width) * in.height, rays = in.rays;
  in.depth.resize(plane), in.pixel.resize(rays), in.direction.resize(3 * rays);
  read(file, in.depth.data(), plane), read(file, in.pixel.data(), rays), read(file, in.direction.data(), 3 * rays);
  return in;
}

RTCScene triangulated(RTCDevice device, const Input& in) {
  std::vector<unsigned> corners;
  for (int y = 0; y + 1 < in.height; ++y)
    for (int x = 0; x + 1 < in.width; ++x) {
      const unsigned a = y * in.width + x, b = a + 1, c = a + in.width, d = c + 1;
      if (in.depth[a] > 0 && in.depth[b] > 0 && in.depth[c] > 0 && in.depth[d] > 0)
        corners.insert(corners.end(), {a, c, b, b, c, d});
    }
  RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), in.depth.size()));
  for (std::size_t i = 0; i < in.depth.size(); ++i) in.point(static_cast<int>(i), vertices + 3 * i);
  void* indices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
                                          corners.size() / 3);
  std::memcpy(indices, corners.data(), corners.size() * sizeof(unsigned));
  rtcCommitGeometry(mesh);
  RTCScene scene = rtcNewScene(device);
  rtcAttachGeometry(scene, mesh);
  rtcReleaseGeometry(mesh);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
  rtcCommitScene(scene);
  return scene;
}

void call(RTCScene scene, RTCIntersectContext* context, const int* valid, RTCRayHit4* rays) {
  rtcIntersect4(valid, scene, context, rays);
}
void call(RTCScene scene, RTCIntersectContext* context, const int* valid, RTCRayHit8* rays) {
  rtcIntersect8(valid, scene, context, rays);
}
void call(RTCScene scene, RTCIntersectContext* context, const int* valid, RTCRayHit16* rays) {
  rtcIntersect16(valid, scene, context, rays);
}

/// Rays first ... end - 1 in packets of N; their primitives into `hit`.
template <class Packet, int N>
void trace_packets(RTCScene scene, const Input& in, int first, int end, unsigned* hit) {
  for (int at = first; at < end; at += N) {
    alignas(64) Packet packet;
    alignas(64) int valid[N];
    for (int k = 0; k < N; ++k) {
      const int i = std::min(at + k, end - 1);
      float origin[3];
      in.point(in.pixel[i], origin);
      auto& ray = packet.ray;
      ray.org_x[k] = origin[0], ray.org_y[k] = origin[1], ray.org_z[k] = origin[2];
      ray.dir_x[k] = in.direction[3 * i], ray.dir_y[k] = in.direction[3 * i + 1],
      ray.dir_z[k] = in.direction[3 * i + 2];
      ray.tnear[k] = kFirst * -origin[2], ray.tfar[k] = INFINITY, ray.time[k] = 0;
      ray.mask[k] = ~0u, ray.flags[k] = 0;
      packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID, packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
      valid[k] = at + k < end ? -1 : 0;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    call(scene, &context, valid, &packet);
    for (int k = 0; k < N && at + k < end; ++k)
      hit[at + k] = packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? ~0u : packet.hit.primID[k];
  }
}

void fill(RTCRayHit& one, const Input& in, int i) {
  float origin[3];
  in.point(in.pixel[i], origin);
  one.ray.org_x = origin[0], one.ray.org_y = origin[1], one.ray.org_z = origin[2];
  one.ray.dir_x = in.direction[3 * i], one.ray.dir_y = in.direction[3 * i + 1], one.ray.dir_z = in.direction[3 * i + 2];
  one.ray.tnear = kFirst * -origin[2], one.ray.tfar = INFINITY, one.ray.time = 0;
  one.ray.mask = ~0u, one.ray.flags = 0;
  one.hit.geomID = RTC_INVALID_GEOMETRY_ID, one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}
unsigned primitive_of(const RTCRayHit& one) { return one.hit.geomID == RTC_INVALID_GEOMETRY_ID ? ~0u : one.hit.primID; }

void trace_singly(RTCScene scene, const Input& in, int first, int end, unsigned* hit) {
  for (int i = first; i < end; ++i) {
    RTCRayHit one;
    fill(one, in, i);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &one);
    hit[i] = primitive_of(one);
  }
}

void trace_stream(RTCScene scene, const Input& in, int first, int end, unsigned* hit) {
  constexpr int most = 256;
  for (int at = first; at < end; at += most) {
    RTCRayHit rays[most];
    const int count = std::min(most, end - at);
    for (int k = 0; k < count; ++k) fill(rays[k], in, at + k);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1M(scene, &context, rays, count, sizeof(RTCRayHit));
    for (int k = 0; k < count; ++k) hit[at + k] = primitive_of(rays[k]);
  }
}

using Trace = void (*)(RTCScene, const Input&, int, int, unsigned*);

double seconds_of(Trace trace, RTCScene scene, const Input& in, int threads, unsigned* hit) {
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int first; (first = next.fetch_add(kBlock)) < in.rays;)
      trace(scene, in, first, std::min(first + kBlock, in.rays), hit);
  };
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(work);
  work();
  for (std::thread& thread : others) thread.join();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 5) return std::fprintf(stderr, "ssrt_embree SCENE THREADS RUNS ISA [WAY]\n"), 2;
  const Input in = read_input(arguments[1]);
  const int threads = std::atoi(arguments[2]), runs = std::atoi(arguments[3]);
  const std::string isa = *arguments[4] ? std::string("isa=") + arguments[4] : "";
  RTCDevice device = rtcNewDevice(isa.c_str());
  if (!device) return std::fprintf(stderr, "ssrt_embree: no Embree device (%s)\n", isa.c_str()), 1;
  RTCScene scene = triangulated(device, in);
  const auto native = [&](RTCDeviceProperty property) { return rtcGetDeviceProperty(device, property) != 0; };
  struct Way {
    const char* name;
    bool there;
    Trace trace;
  };
  const Way ways[]{
      {"rtcIntersect1", true, trace_singly},
      {"rtcIntersect1M", true, trace_stream},
      {"rtcIntersect4", native(RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED), trace_packets<RTCRayHit4, 4>},
      {"rtcIntersect8", native(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED), trace_packets<RTCRayHit8, 8>},
      {"rtcIntersect16", native(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED), trace_packets<RTCRayHit16, 16>},
  };
  std::vector<unsigned> hit(in.rays);
  for (const Way& way : ways) {
    if (!way.there || (count > 5 && std::strcmp(way.name, arguments[5]) != 0)) continue;
    seconds_of(way.trace, scene, in, threads, hit.data());
    std::vector<double> seconds;
    for (int run = 0; run < runs; ++run) seconds.push_back(seconds_of(way.trace, scene, in, threads, hit.data()));
    const auto hits = std::count_if(hit.begin(), hit.end(), [](unsigned primitive) { return primitive != ~0u; });
    std::printf("%s %.6f", way.name, static_cast<double>(hits) / in.rays);
    for (const double s : seconds) std::printf(" %.6f", s);
    std::printf("\n");
  }
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}
