// The yardstick of `nearfar bench --backends`: rays through a plain loop on Embree's own API, with the scene settings of the backend.
// Usage: embree_loop FILE THREADS. FILE (native byte order): u64 vertices, triangles, streams; float[3] each; uint32[3] each; then for each
// stream u64 any, u64 n and n rays of 8 floats (origin, t_min, dir, t_max). Prints `build SECONDS`, then answers lines of
// `STREAM WIDTH THREADS` on stdin by `SECONDS HITS` until the end of the input.
#include <embree4/rtcore.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>
#include <vector>

struct Ray {
  float org[3], tnear, dir[3], tfar;
};
struct Hit {
  float t, u, v;
  uint32_t triangle;
};
struct Stream {
  uint64_t any, n;
  std::vector<Ray> rays;
};

static double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

template <class T> static std::vector<T> read(FILE *file, size_t n) {
  std::vector<T> values(n);
  if (n != 0 && fread(values.data(), sizeof(T), n, file) != n) {
    fprintf(stderr, "short file\n");
    exit(1);
  }
  return values;
}

template <class P> static void set(P &r, int j, const Ray &ray) {
  r.org_x[j] = ray.org[0], r.org_y[j] = ray.org[1], r.org_z[j] = ray.org[2], r.tnear[j] = ray.tnear;
  r.dir_x[j] = ray.dir[0], r.dir_y[j] = ray.dir[1], r.dir_z[j] = ray.dir[2], r.tfar[j] = ray.tfar;
  r.time[j] = 0, r.mask[j] = ~0u, r.id[j] = 0, r.flags[j] = 0;
}

static void set(RTCRay &r, const Ray &ray) {
  r.org_x = ray.org[0], r.org_y = ray.org[1], r.org_z = ray.org[2], r.tnear = ray.tnear;
  r.dir_x = ray.dir[0], r.dir_y = ray.dir[1], r.dir_z = ray.dir[2], r.tfar = ray.tfar;
  r.time = 0, r.mask = ~0u, r.id = 0, r.flags = 0;
}

static void intersect(const int *valid, RTCScene s, RTCRayHit8 *rh) { rtcIntersect8(valid, s, rh, nullptr); }
static void intersect(const int *valid, RTCScene s, RTCRayHit16 *rh) { rtcIntersect16(valid, s, rh, nullptr); }
static void occluded(const int *valid, RTCScene s, RTCRay8 *r) { rtcOccluded8(valid, s, r, nullptr); }
static void occluded(const int *valid, RTCScene s, RTCRay16 *r) { rtcOccluded16(valid, s, r, nullptr); }

template <int K, class RayHit, class RayK> static void packets(RTCScene scene, const Stream &stream, Hit *hits, size_t begin, size_t end) {
  alignas(64) int valid[K];
  for (size_t i = begin; i < end; i += K) {
    const int count = int(end - i < K ? end - i : K);
    for (int j = 0; j < K; ++j) valid[j] = j < count ? -1 : 0;
    if (stream.any) {
      RayK r;
      for (int j = 0; j < K; ++j) set(r, j, stream.rays[i + (j < count ? j : 0)]);
      occluded(valid, scene, &r);
      for (int j = 0; j < count; ++j) hits[i + j].triangle = r.tfar[j] < 0 ? 0 : RTC_INVALID_GEOMETRY_ID;
    } else {
      RayHit rh;
      for (int j = 0; j < K; ++j) {
        set(rh.ray, j, stream.rays[i + (j < count ? j : 0)]);
        rh.hit.geomID[j] = rh.hit.primID[j] = rh.hit.instID[0][j] = RTC_INVALID_GEOMETRY_ID;
      }
      intersect(valid, scene, &rh);
      for (int j = 0; j < count; ++j) hits[i + j] = Hit{rh.ray.tfar[j], rh.hit.u[j], rh.hit.v[j], rh.hit.primID[j]};
    }
  }
}

static void single(RTCScene scene, const Stream &stream, Hit *hits, size_t begin, size_t end) {
  for (size_t i = begin; i < end; ++i) {
    if (stream.any) {
      RTCRay r;
      set(r, stream.rays[i]);
      rtcOccluded1(scene, &r, nullptr);
      hits[i].triangle = r.tfar < 0 ? 0 : RTC_INVALID_GEOMETRY_ID;
    } else {
      RTCRayHit rh;
      set(rh.ray, stream.rays[i]);
      rh.hit.geomID = rh.hit.primID = rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene, &rh, nullptr);
      hits[i] = Hit{rh.ray.tfar, rh.hit.u, rh.hit.v, rh.hit.primID};
    }
  }
}

static void run(RTCScene scene, const Stream &stream, Hit *hits, int width, size_t begin, size_t end) {
  if (width == 8) packets<8, RTCRayHit8, RTCRay8>(scene, stream, hits, begin, end);
  else if (width == 16) packets<16, RTCRayHit16, RTCRay16>(scene, stream, hits, begin, end);
  else single(scene, stream, hits, begin, end);
}

int main(int argc, char **argv) {
  if (argc != 3) return 2;
  FILE *file = fopen(argv[1], "rb");
  if (!file) return 2;
  const auto counts = read<uint64_t>(file, 3);
  auto vertices = read<float>(file, counts[0] * 3);
  auto triangles = read<uint32_t>(file, counts[1] * 3);
  std::vector<Stream> streams(counts[2]);
  for (auto &s : streams) {
    const auto head = read<uint64_t>(file, 2);
    s.any = head[0], s.n = head[1];
    s.rays = read<Ray>(file, s.n);
  }
  fclose(file);
  vertices.resize(vertices.size() + 4);

  const double start = now();
  RTCDevice device = rtcNewDevice(("threads=" + std::string(argv[2])).c_str());
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices.data(), 0, 12, counts[0]);
  rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles.data(), 0, 12, counts[1]);
  rtcCommitGeometry(mesh);
  rtcAttachGeometry(scene, mesh);
  rtcReleaseGeometry(mesh);
  rtcCommitScene(scene);
  printf("build %.6f\n", now() - start);
  fflush(stdout);

  size_t stream, width, threads;
  std::vector<Hit> hits;
  while (scanf("%zu %zu %zu", &stream, &width, &threads) == 3 && stream < streams.size()) {
    const Stream &s = streams[stream];
    hits.resize(s.n);
    const double begin = now();
    if (threads <= 1) {
      run(scene, s, hits.data(), int(width), 0, s.n);
    } else {
      std::atomic<size_t> next{0};
      std::vector<std::thread> workers;
      for (size_t i = 0; i < threads; ++i)
        workers.emplace_back([&] {
          for (size_t block; (block = next.fetch_add(4096)) < s.n;) run(scene, s, hits.data(), int(width), block, block + 4096 < s.n ? block + 4096 : s.n);
        });
      for (auto &worker : workers) worker.join();
    }
    const double seconds = now() - begin;
    size_t count = 0;
    for (const Hit &hit : hits) count += hit.triangle != RTC_INVALID_GEOMETRY_ID;
    printf("%.9f %zu\n", seconds, count);
    fflush(stdout);
  }
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  return 0;
}
