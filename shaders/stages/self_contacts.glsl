// The stages find_self_contacts, solve_self_contacts and guard_self_contacts of the tiled plan: one work group takes
// all pairs of a cloth (server/solver/gl_compute/self_contacts.md). Here: the record, the state that the kernels pass
// on, the pairs in Scratch, reductions over the work group. A kernel begins with COUNTS_IN_SCRATCH and
// SOLVES_IN_SCRATCH, since integers are added up in Scratch and its phases read what others wrote.
#ifndef DRAPE_STAGES_SELF_CONTACTS_GLSL_
#define DRAPE_STAGES_SELF_CONTACTS_GLSL_

#include "interface/self_contact_record.h"
#include "stages/access_tiled.glsl"
#include "lib/closest_points.glsl"
#include "lib/fault.glsl"
#include "lib/float_order.glsl"
#include "stages/previous.glsl"
#include "stages/substep.glsl"

// Each element once: an invocation takes every LOCAL_SIZE-th.
#define FOR_EACH(index, begin, end) \
  for (uint index = (begin) + gl_LocalInvocationID.x; index < (end); index += LOCAL_SIZE)

const uint kNone = 0xffffffffu;

SelfContactRecord contact;

#define DRAPE_LOAD_NUMBER(name)      \
  contact.name = Parameter(word); \
  ++word;
#define DRAPE_LOAD_COUNT(name)        \
  contact.name = parameters[word]; \
  ++word;
void LoadSelfContacts() {
  uint word = cloth.step.self_contacts;
  DRAPE_CONTACT_MEMBERS(DRAPE_LOAD_NUMBER, DRAPE_LOAD_COUNT)
}

// One of the kernels of the tiled plan that have phases of their own.
void EndPhase() {
  memoryBarrierBuffer();
  memoryBarrierShared();
  barrier();
}

// The passes through loops that an invocation has made or may have made, the same in all of them: drivers may cut long
// loops (server/gl/drivers.md). What would take too many is left out where it may be; the guard then holds the cloth.
uint used_passes = 0u;

// A loop over so many elements.
void CountLoop(uint elements) { used_passes += elements / uint(LOCAL_SIZE) + 3u; }
bool IsOutOfPasses() { return used_passes > CONTACT_LOOP_BUDGET / 2u; }

// What the kernels pass on; the same in all invocations.
uint pair_count;
uint substeps_left;   // that the last search is for
uint since_search;    // substeps
bool has_all_pairs;   // of the last search
float drift;          // that it allows for [m]
float drift_scale;    // [-]
uint given_up;        // substeps, one after the other, of which not all pairs were found
uint turn_count;      // of the pairs of this substep

void LoadContactState() {
  uint word = contact.state;
  pair_count = scratch_words[word];
  substeps_left = scratch_words[word + 1u];
  since_search = scratch_words[word + 2u];
  has_all_pairs = scratch_words[word + 3u] != 0u;
  drift = uintBitsToFloat(scratch_words[word + 4u]);
  drift_scale = uintBitsToFloat(scratch_words[word + 5u]);
  turn_count = scratch_words[word + 6u];
  given_up = scratch_words[word + 7u];
}

// In uniform control flow; all invocations have read the state before.
void StoreContactState() {
  if (gl_LocalInvocationID.x != 0u) return;
  uint word = contact.state;
  scratch_words[word] = pair_count;
  scratch_words[word + 1u] = substeps_left;
  scratch_words[word + 2u] = since_search;
  scratch_words[word + 3u] = has_all_pairs ? 1u : 0u;
  scratch_words[word + 4u] = floatBitsToUint(drift);
  scratch_words[word + 5u] = floatBitsToUint(drift_scale);
  scratch_words[word + 6u] = turn_count;
  scratch_words[word + 7u] = given_up;
}

vec3 Start(uint i) { return ScratchVector(contact.starts + 3u * i); }
void SetStart(uint i, vec3 p) { SetScratchVector(contact.starts + 3u * i, p); }

Corners CornersAtStart(uvec4 i) { return Corners(Start(i.x), Start(i.y), Start(i.z), Start(i.w)); }
Corners CornersAtEnd(uvec4 i) { return Corners(Position(i.x), Position(i.y), Position(i.z), Position(i.w)); }
Corners Velocities(uvec4 i) { return Corners(Velocity(i.x), Velocity(i.y), Velocity(i.z), Velocity(i.w)); }

Corners Ways(uvec4 i) {
  Corners from = CornersAtStart(i);
  Corners to = CornersAtEnd(i);
  precise vec3 a = to.a - from.a;
  precise vec3 b = to.b - from.b;
  precise vec3 c = to.c - from.c;
  precise vec3 d = to.d - from.d;
  return Corners(a, b, c, d);
}

// Flags of a pair.
const uint kAreEdges = 1u;
const uint kLeftAlone = 2u;  // crossed or touched when it was found
const uint kActive = 4u;     // looked at in this substep
const uint kResting = 8u;    // at its floor when the substep begins, to rounding
const uint kHit = 16u;       // pushed by this substep's impulses or its guard
const uint kHasPlanes = 32u;
const uint kCovered = 64u;   // a triangle beside is nearer: no impulses
const uint kLands = 128u;    // faster than what rests when the substep begins

const uint kFlagsField = 4u;
const uint kTouchField = 5u;
const uint kNormalField = 6u;
const uint kWeightsField = 9u;
const uint kInverseMassField = 13u;
const uint kGapField = 14u;
const uint kFloorField = 15u;
const uint kPushField = 16u;
const uint kTangentField = 17u;
const uint kSlidingField = 20u;

// Pairs are stored number by number: neighbours in the list are neighbours in memory.
uint PairWord(uint field, uint k) { return contact.pairs + field * contact.capacity + k; }
float PairNumber(uint field, uint k) { return uintBitsToFloat(scratch_words[PairWord(field, k)]); }
void SetPairNumber(uint field, uint k, float value) { scratch_words[PairWord(field, k)] = floatBitsToUint(value); }
vec3 PairVector(uint field, uint k) {
  return vec3(PairNumber(field, k), PairNumber(field + 1u, k), PairNumber(field + 2u, k));
}
void SetPairVector(uint field, uint k, vec3 value) {
  SetPairNumber(field, k, value.x);
  SetPairNumber(field + 1u, k, value.y);
  SetPairNumber(field + 2u, k, value.z);
}
uint PairFlags(uint k) { return scratch_words[PairWord(kFlagsField, k)]; }
void SetPairFlags(uint k, uint flags) { scratch_words[PairWord(kFlagsField, k)] = flags; }
uvec4 PairParticles(uint k) {
  return uvec4(scratch_words[PairWord(0u, k)], scratch_words[PairWord(1u, k)], scratch_words[PairWord(2u, k)],
               scratch_words[PairWord(3u, k)]);
}
vec4 PairWeights(uint k) {
  return vec4(PairVector(kWeightsField, k), PairNumber(kWeightsField + 3u, k));
}
vec4 InverseMasses(uvec4 i) {
  return vec4(InverseMass(i.x), InverseMass(i.y), InverseMass(i.z), InverseMass(i.w));
}

// The weighted sum of vectors of the particles; differences to the first keep their digits.
vec3 Weighted(vec4 weights, Corners v) {
  precise vec3 sum = weights.y * (v.b - v.a) + weights.z * (v.c - v.a) + weights.w * (v.d - v.a);
  return sum;
}

// The largest of numbers over all invocations, several at a time: each offers its own, EndOffers is a barrier, then all
// read the results until the next offers end. Three sets in turn: one is written, one read, one cleared.
const uint kOffers = 8u;
shared uint shared_largest[3u * kOffers];
uint offer_set = 0u;
uint taken_set = 0u;

// In uniform control flow, before the first offer.
void BeginOffers() {
  FOR_EACH(k, 0u, 3u * kOffers) shared_largest[k] = 0u;
  EndPhase();
}
void OfferBits(uint which, uint bits) { atomicMax(shared_largest[offer_set * kOffers + which], bits); }
void EndOffers() {
  taken_set = offer_set;
  offer_set = (offer_set + 1u) % 3u;
  if (gl_LocalInvocationID.x < kOffers) shared_largest[offer_set * kOffers + gl_LocalInvocationID.x] = 0u;
  EndPhase();
}
uint Largest(uint which) { return shared_largest[taken_set * kOffers + which]; }

// Numbers that are not negative.
void OfferSize(uint which, float size) { OfferBits(which, floatBitsToUint(size)); }
float LargestSize(uint which) { return uintBitsToFloat(Largest(which)); }

bool IsAny(bool mine) {
  if (mine) OfferBits(0u, 1u);
  EndOffers();
  return Largest(0u) != 0u;
}

// The range of vectors, of which an invocation has seen those between low and high: the first six offers.
void OfferRange(vec3 low, vec3 high) {
  OfferBits(0u, OrderedBits(-low.x));
  OfferBits(1u, OrderedBits(-low.y));
  OfferBits(2u, OrderedBits(-low.z));
  OfferBits(3u, OrderedBits(high.x));
  OfferBits(4u, OrderedBits(high.y));
  OfferBits(5u, OrderedBits(high.z));
}
float LargestDifference() {
  vec3 low = -vec3(FloatFromOrderedBits(Largest(0u)), FloatFromOrderedBits(Largest(1u)),
                   FloatFromOrderedBits(Largest(2u)));
  vec3 high = vec3(FloatFromOrderedBits(Largest(3u)), FloatFromOrderedBits(Largest(4u)),
                   FloatFromOrderedBits(Largest(5u)));
  precise vec3 range = high - low;
  return Length(range);
}

#endif
