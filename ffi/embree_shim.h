/* The border between nearfar and Embree: plain arrays in, plain arrays out. The only header that bindgen reads.
 *
 * Every Embree structure stays on the C side, laid out by the installed headers. Handles of devices, scenes and geometries cross as
 * opaque pointers; ownership of them stays with the caller. No function here allocates, keeps a pointer (but for nf_set_mask) or fails. */
#ifndef NEARFAR_EMBREE_SHIM_H
#define NEARFAR_EMBREE_SHIM_H
#include <stddef.h>
#include <stdint.h>

/* 32 bytes: points origin + t * dir for t in the open interval (t_min, t_max); 0 <= t_min. */
typedef struct NfRay {
  float origin[3];
  float t_min;
  float dir[3];
  float t_max;
} NfRay;

/* 16 bytes: triangle is NF_MISS when nothing was hit, and t, u, v are then meaningless. */
typedef struct NfHit {
  float t, u, v;
  uint32_t triangle;
} NfHit;

enum { NF_MISS = 0xffffffffu };

/* True when the surface exists at barycentrics (u, v) of the triangle. Called from inside ray queries, on any thread. */
typedef uint8_t (*NfExists)(const void *user, uint32_t triangle, float u, float v);

/* Version of the headers this file was compiled with: major * 10000 + minor * 100 + patch. */
uint32_t nf_header_version(void);

/* Shoots rays at a triangle of its own in packets of 1, 8 and 16. 0: all well; 1: a hit was missed or wrong (the library lays out rays in
 * another way); 2: Embree wrote behind the structure that the headers describe. */
int nf_self_check(void *device);

/* The device's error since the last call, 0 for none; *text is a static string that names it. device may be NULL (device creation). */
int nf_take_error(void *device, const char **text);

/* Where a masked surface exists: a question and what it is asked of. */
typedef struct NfMask {
  NfExists exists;
  const void *user;
} NfMask;

/* Makes every query of the geometry ask the mask at each candidate hit. *mask and what it points to must outlive the scene's last query. */
void nf_set_mask(void *geometry, const NfMask *mask);

/* Closest hit and any hit of n rays, in packets of 1, 8 or 16 (any other width counts as 1). */
void nf_closest(void *scene, const NfRay *rays, NfHit *hits, size_t n, uint32_t width);
void nf_occluded(void *scene, const NfRay *rays, uint8_t *occluded, size_t n, uint32_t width);

#endif
