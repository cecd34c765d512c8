/* See embree_shim.h. The only file of the program that includes Embree's headers (ffi/embree_loop.cpp is a benchmark of its own). */
#include "embree_shim.h"

#include <embree4/rtcore.h>
#include <math.h>
#include <string.h>

_Static_assert(sizeof(NfRay) == 32 && sizeof(NfHit) == 16, "the layouts that src/ffi/embree.rs expects");
_Static_assert(RTC_VERSION_MAJOR == 4 && RTC_VERSION_MINOR >= 3, "Embree 4.3 or later");

uint32_t nf_header_version(void) { return RTC_VERSION_MAJOR * 10000u + RTC_VERSION_MINOR * 100u + RTC_VERSION_PATCH; }

int nf_take_error(void *device, const char **text) {
  const enum RTCError code = rtcGetDeviceError((RTCDevice)device);
  switch (code) {
  case RTC_ERROR_NONE: *text = "no error"; break;
  case RTC_ERROR_INVALID_ARGUMENT: *text = "invalid argument"; break;
  case RTC_ERROR_INVALID_OPERATION: *text = "invalid operation"; break;
  case RTC_ERROR_OUT_OF_MEMORY: *text = "out of memory"; break;
  case RTC_ERROR_UNSUPPORTED_CPU: *text = "this CPU is not supported (SSE2 at least)"; break;
  case RTC_ERROR_CANCELLED: *text = "cancelled"; break;
  default: *text = "unknown error"; break;
  }
  return (int)code;
}

/* Embree's interval is closed; ours is open at both ends: the smallest float above t_min, and the largest below t_max. */
static inline float first_above(float t_min) {
  if (!(t_min >= 0.0f)) t_min = 0.0f;
  uint32_t bits;
  memcpy(&bits, &t_min, 4);
  bits = (bits & 0x7fffffffu) + 1;
  memcpy(&t_min, &bits, 4);
  return t_min;
}

static inline float last_below(float t_max) {
  if (t_max == INFINITY) return t_max;
  if (!(t_max > 0.0f)) return -1.0f; /* an empty interval: Embree leaves such rays alone */
  uint32_t bits;
  memcpy(&bits, &t_max, 4);
  bits -= 1;
  memcpy(&t_max, &bits, 4);
  return t_max;
}

static inline void fill_ray(struct RTCRay *r, const NfRay *ray) {
  r->org_x = ray->origin[0];
  r->org_y = ray->origin[1];
  r->org_z = ray->origin[2];
  r->tnear = first_above(ray->t_min);
  r->dir_x = ray->dir[0];
  r->dir_y = ray->dir[1];
  r->dir_z = ray->dir[2];
  r->time = 0.0f;
  r->tfar = last_below(ray->t_max);
  r->mask = (unsigned)-1;
  r->id = 0;
  r->flags = 0;
}

static void closest_1(RTCScene scene, const NfRay *rays, NfHit *hits, size_t n) {
  struct RTCRayHit rh;
  for (size_t i = 0; i < n; ++i) {
    fill_ray(&rh.ray, &rays[i]);
    rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rh.hit.primID = RTC_INVALID_GEOMETRY_ID;
    rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &rh, NULL);
    hits[i].t = rh.ray.tfar;
    hits[i].u = rh.hit.u;
    hits[i].v = rh.hit.v;
    hits[i].triangle = rh.hit.geomID == RTC_INVALID_GEOMETRY_ID ? NF_MISS : rh.hit.primID;
  }
}

static void occluded_1(RTCScene scene, const NfRay *rays, uint8_t *occluded, size_t n) {
  struct RTCRay r;
  for (size_t i = 0; i < n; ++i) {
    fill_ray(&r, &rays[i]);
    const float before = r.tfar;
    rtcOccluded1(scene, &r, NULL);
    occluded[i] = before >= 0.0f && r.tfar == -INFINITY;
  }
}

/* Packets of K rays. Lanes past the end of the array are not valid, and Embree leaves them alone. */
#define NF_PACKET(K)                                                                                                                       \
  static void fill_##K(struct RTCRay##K *r, int *valid, const NfRay *rays, size_t count) {                                                 \
    for (size_t j = 0; j < K; ++j) {                                                                                                       \
      const NfRay *ray = &rays[j < count ? j : 0];                                                                                         \
      r->org_x[j] = ray->origin[0];                                                                                                        \
      r->org_y[j] = ray->origin[1];                                                                                                        \
      r->org_z[j] = ray->origin[2];                                                                                                        \
      r->tnear[j] = first_above(ray->t_min);                                                                                               \
      r->dir_x[j] = ray->dir[0];                                                                                                           \
      r->dir_y[j] = ray->dir[1];                                                                                                           \
      r->dir_z[j] = ray->dir[2];                                                                                                           \
      r->time[j] = 0.0f;                                                                                                                   \
      r->tfar[j] = last_below(ray->t_max);                                                                                                 \
      r->mask[j] = (unsigned)-1;                                                                                                           \
      r->id[j] = 0;                                                                                                                        \
      r->flags[j] = 0;                                                                                                                     \
      valid[j] = j < count && r->tfar[j] >= 0.0f ? -1 : 0;                                                                                 \
    }                                                                                                                                      \
  }                                                                                                                                        \
  static void closest_##K(RTCScene scene, const NfRay *rays, NfHit *hits, size_t n) {                                                      \
    struct RTCRayHit##K rh;                                                                                                                \
    _Alignas(64) int valid[K];                                                                                                             \
    for (size_t i = 0; i < n; i += K) {                                                                                                    \
      const size_t count = n - i < K ? n - i : K;                                                                                          \
      fill_##K(&rh.ray, valid, rays + i, count);                                                                                           \
      for (size_t j = 0; j < K; ++j) {                                                                                                     \
        rh.hit.geomID[j] = RTC_INVALID_GEOMETRY_ID;                                                                                        \
        rh.hit.primID[j] = RTC_INVALID_GEOMETRY_ID;                                                                                        \
        rh.hit.instID[0][j] = RTC_INVALID_GEOMETRY_ID;                                                                                     \
      }                                                                                                                                    \
      rtcIntersect##K(valid, scene, &rh, NULL);                                                                                            \
      for (size_t j = 0; j < count; ++j) {                                                                                                 \
        hits[i + j].t = rh.ray.tfar[j];                                                                                                    \
        hits[i + j].u = rh.hit.u[j];                                                                                                       \
        hits[i + j].v = rh.hit.v[j];                                                                                                       \
        hits[i + j].triangle = rh.hit.geomID[j] == RTC_INVALID_GEOMETRY_ID ? NF_MISS : rh.hit.primID[j];                                   \
      }                                                                                                                                    \
    }                                                                                                                                      \
  }                                                                                                                                        \
  static void occluded_##K(RTCScene scene, const NfRay *rays, uint8_t *occluded, size_t n) {                                               \
    struct RTCRay##K r;                                                                                                                    \
    _Alignas(64) int valid[K];                                                                                                             \
    for (size_t i = 0; i < n; i += K) {                                                                                                    \
      const size_t count = n - i < K ? n - i : K;                                                                                          \
      fill_##K(&r, valid, rays + i, count);                                                                                                \
      rtcOccluded##K(valid, scene, &r, NULL);                                                                                              \
      for (size_t j = 0; j < count; ++j) occluded[i + j] = valid[j] && r.tfar[j] == -INFINITY;                                             \
    }                                                                                                                                      \
  }

NF_PACKET(8)
NF_PACKET(16)

void nf_closest(void *scene, const NfRay *rays, NfHit *hits, size_t n, uint32_t width) {
  switch (width) {
  case 8: closest_8((RTCScene)scene, rays, hits, n); break;
  case 16: closest_16((RTCScene)scene, rays, hits, n); break;
  default: closest_1((RTCScene)scene, rays, hits, n); break;
  }
}

void nf_occluded(void *scene, const NfRay *rays, uint8_t *occluded, size_t n, uint32_t width) {
  switch (width) {
  case 8: occluded_8((RTCScene)scene, rays, occluded, n); break;
  case 16: occluded_16((RTCScene)scene, rays, occluded, n); break;
  default: occluded_1((RTCScene)scene, rays, occluded, n); break;
  }
}

/* A hit packet of N lanes is rows of N words: Ng_x Ng_y Ng_z u v primID ... (the accessors of Embree's header are for C++ only). */
enum { ROW_U = 3, ROW_V = 4, ROW_PRIMITIVE = 5 };
_Static_assert(offsetof(struct RTCHit8, u) == ROW_U * 32 && offsetof(struct RTCHit8, v) == ROW_V * 32, "rows of a hit packet");
_Static_assert(offsetof(struct RTCHit8, primID) == ROW_PRIMITIVE * 32 && offsetof(struct RTCHit, primID) == ROW_PRIMITIVE * 4, "rows of a hit packet");

static void filter(const struct RTCFilterFunctionNArguments *args) {
  const NfMask *mask = (const NfMask *)args->geometryUserPtr;
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] != -1) continue;
    const float u = ((const float *)args->hit)[ROW_U * args->N + i], v = ((const float *)args->hit)[ROW_V * args->N + i];
    if (!mask->exists(mask->user, ((const uint32_t *)args->hit)[ROW_PRIMITIVE * args->N + i], u, v)) args->valid[i] = 0;
  }
}

void nf_set_mask(void *geometry, const NfMask *mask) {
  rtcSetGeometryUserData((RTCGeometry)geometry, (void *)mask);
  rtcSetGeometryIntersectFilterFunction((RTCGeometry)geometry, filter);
  rtcSetGeometryOccludedFilterFunction((RTCGeometry)geometry, filter);
}

/* A ray towards (1/4, 1/4, 1) of a triangle in the plane z = 1, with bytes of a known value behind the structure. */
enum { GUARD = 64 };

static int untouched(const unsigned char *guard) {
  for (int i = 0; i < GUARD; ++i)
    if (guard[i] != 0xa5) return 0;
  return 1;
}

static int right(float t, float u, float v, unsigned primitive) {
  return fabsf(t - 1.0f) < 1e-5f && fabsf(u - 0.25f) < 1e-5f && fabsf(v - 0.25f) < 1e-5f && primitive == 0;
}

#define NF_CHECK_PACKET(K)                                                                                                                 \
  static int check_##K(RTCScene scene, const NfRay *ray) {                                                                                 \
    struct {                                                                                                                               \
      struct RTCRayHit##K rh;                                                                                                              \
      unsigned char guard[GUARD];                                                                                                          \
    } probe;                                                                                                                               \
    _Alignas(64) int valid[K];                                                                                                             \
    NfRay rays[K];                                                                                                                         \
    for (int j = 0; j < K; ++j) rays[j] = *ray;                                                                                            \
    memset(&probe, 0xa5, sizeof probe);                                                                                                    \
    fill_##K(&probe.rh.ray, valid, rays, K);                                                                                               \
    for (int j = 0; j < K; ++j) probe.rh.hit.geomID[j] = RTC_INVALID_GEOMETRY_ID;                                                          \
    rtcIntersect##K(valid, scene, &probe.rh, NULL);                                                                                        \
    if (!untouched(probe.guard)) return 2;                                                                                                 \
    for (int j = 0; j < K; ++j)                                                                                                            \
      if (!right(probe.rh.ray.tfar[j], probe.rh.hit.u[j], probe.rh.hit.v[j], probe.rh.hit.primID[j])) return 1;                            \
    return 0;                                                                                                                              \
  }

NF_CHECK_PACKET(8)
NF_CHECK_PACKET(16)

static int check_1(RTCScene scene, const NfRay *ray) {
  struct {
    struct RTCRayHit rh;
    unsigned char guard[GUARD];
  } probe;
  memset(&probe, 0xa5, sizeof probe);
  fill_ray(&probe.rh.ray, ray);
  probe.rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &probe.rh, NULL);
  if (!untouched(probe.guard)) return 2;
  return right(probe.rh.ray.tfar, probe.rh.hit.u, probe.rh.hit.v, probe.rh.hit.primID) ? 0 : 1;
}

int nf_self_check(void *device) {
  static const float corners[9] = {0, 0, 1, 1, 0, 1, 0, 1, 1};
  static const unsigned indices[3] = {0, 1, 2};
  static const NfRay ray = {{0.25f, 0.25f, 0.0f}, 0.0f, {0.0f, 0.0f, 1.0f}, INFINITY};
  RTCGeometry geometry = rtcNewGeometry((RTCDevice)device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3);
  void *triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, 1);
  RTCScene scene = rtcNewScene((RTCDevice)device);
  int answer = 1;
  if (vertices && triangles && scene) {
    memcpy(vertices, corners, sizeof corners);
    memcpy(triangles, indices, sizeof indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcCommitScene(scene);
    answer = check_1(scene, &ray);
    if (answer == 0) answer = check_8(scene, &ray);
    if (answer == 0) answer = check_16(scene, &ray);
  }
  rtcReleaseGeometry(geometry);
  rtcReleaseScene(scene);
  return answer;
}
