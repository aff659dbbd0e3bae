// Groups of DRAPE_STRIP_LANES invocations (lanes) that solve a strip together and exchange values: by the shuffles
// of a subgroup (HAS_SUBGROUPS) or, on devices without them, through shared memory and barriers. Resident plan
// only.
#ifndef DRAPE_STAGES_LANES_GLSL_
#define DRAPE_STAGES_LANES_GLSL_

#include "stages/access_resident.glsl"

#ifdef HAS_SUBGROUPS

// Whether the invocations fill whole subgroups, and these whole groups of lanes. A driver may promise a
// subgroup size that it does not fill.
bool FillsSubgroups() {
  return gl_SubgroupSize % DRAPE_STRIP_LANES == 0u &&
         gl_NumSubgroups * gl_SubgroupSize == uint(LOCAL_SIZE);
}

uint LaneGroupCount() { return uint(LOCAL_SIZE) / DRAPE_STRIP_LANES; }
uint LaneGroup() {
  return (gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID) / DRAPE_STRIP_LANES;
}
uint Lane() { return gl_SubgroupInvocationID % DRAPE_STRIP_LANES; }

vec4 offered;
uint offered_tag;

// Offers a value to the other lanes, which may take it until the next offer. All invocations of the work group
// call it together.
void Offer(vec4 value, uint tag) {
  subgroupBarrier();  // the lanes may have diverged
  offered = value;
  offered_tag = tag;
}
uint InvocationOfLane(uint lane) { return gl_SubgroupInvocationID - Lane() + lane; }
vec4 OfferOf(uint lane) { return subgroupShuffle(offered, InvocationOfLane(lane)); }
uint TagOf(uint lane) { return subgroupShuffle(offered_tag, InvocationOfLane(lane)); }

// All lanes of the group have finished reading before any of them writes to shared memory after this.
void LaneBarrier() {
  subgroupMemoryBarrierShared();
  subgroupBarrier();
}

#else

bool FillsSubgroups() { return true; }

const uint kLaneCount = min(uint(LOCAL_SIZE), DRAPE_SHARED_LANES);
shared float offered[4u * kLaneCount];
shared uint offered_tags[kLaneCount];

uint LaneGroupCount() { return kLaneCount / DRAPE_STRIP_LANES; }
uint LaneGroup() { return gl_LocalInvocationID.x / DRAPE_STRIP_LANES; }
uint Lane() { return gl_LocalInvocationID.x % DRAPE_STRIP_LANES; }

void Offer(vec4 value, uint tag) {
  PhaseBarrier();
  uint place = gl_LocalInvocationID.x;
  if (place < kLaneCount) {
    offered[4u * place] = value.x;
    offered[4u * place + 1u] = value.y;
    offered[4u * place + 2u] = value.z;
    offered[4u * place + 3u] = value.w;
    offered_tags[place] = tag;
  }
  PhaseBarrier();
}
uint PlaceOfLane(uint lane) {
  return min(DRAPE_STRIP_LANES * LaneGroup(), kLaneCount - DRAPE_STRIP_LANES) + lane;
}
vec4 OfferOf(uint lane) {
  uint word = 4u * PlaceOfLane(lane);
  return vec4(offered[word], offered[word + 1u], offered[word + 2u], offered[word + 3u]);
}
uint TagOf(uint lane) { return offered_tags[PlaceOfLane(lane)]; }

void LaneBarrier() { PhaseBarrier(); }

#endif

#endif
