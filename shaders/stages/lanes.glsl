// Groups of DRAPE_STRIP_LANES invocations (lanes) that exchange values: by the shuffles of a subgroup
// (HAS_SUBGROUPS) or, on devices without them, through shared memory and barriers. Resident plan only. All
// invocations of the work group call these functions together.
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

// Lanes of all groups, and the place of this one among them.
uint LaneCount() { return uint(LOCAL_SIZE); }
uint LaneSlot() { return gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID; }
uint Lane() { return gl_SubgroupInvocationID % DRAPE_STRIP_LANES; }

vec4 offered;

// Offers a value to the other lanes, which may take it until the next offer. No barrier of the subgroup: the control
// flow is uniform, and it is slow (server/gl/drivers.md).
void Offer(vec4 value) { offered = value; }
vec4 OfferOf(uint lane) { return subgroupShuffle(offered, gl_SubgroupInvocationID - Lane() + lane); }

// A bit per lane of the group.
uint LanesWith(bool flag) {
  uvec4 flags = subgroupBallot(flag);
  uint group = gl_SubgroupInvocationID / DRAPE_STRIP_LANES;
  return group == 0u ? flags.x : group == 1u ? flags.y : group == 2u ? flags.z : flags.w;
}

// Whether any lane has the flag, of this group and maybe of others; the same for all that take an offer.
bool HasAnyLane(bool flag) {
  uvec4 flags = subgroupBallot(flag);
  return (flags.x | flags.y | flags.z | flags.w) != 0u;
}

#else

bool FillsSubgroups() { return true; }

const uint kLaneCount = min(uint(LOCAL_SIZE), DRAPE_SHARED_LANES);
shared float offered[4u * kLaneCount];
shared uint lanes_with[kLaneCount / DRAPE_STRIP_LANES];

uint LaneCount() { return kLaneCount; }
uint LaneSlot() { return gl_LocalInvocationID.x; }
uint Lane() { return gl_LocalInvocationID.x % DRAPE_STRIP_LANES; }

void Offer(vec4 value) {
  PhaseBarrier();
  uint place = gl_LocalInvocationID.x;
  if (place < kLaneCount) {
    offered[4u * place] = value.x;
    offered[4u * place + 1u] = value.y;
    offered[4u * place + 2u] = value.z;
    offered[4u * place + 3u] = value.w;
  }
  PhaseBarrier();
}

// That of this invocation; those that are no lanes take part as if they were of the last group.
uint LaneGroup() { return min(gl_LocalInvocationID.x, kLaneCount - 1u) / DRAPE_STRIP_LANES; }
vec4 OfferOf(uint lane) {
  uint word = 4u * (DRAPE_STRIP_LANES * LaneGroup() + lane);
  return vec4(offered[word], offered[word + 1u], offered[word + 2u], offered[word + 3u]);
}

void FlagLanes(bool flag) {
  uint place = gl_LocalInvocationID.x;
  PhaseBarrier();
  if (place < kLaneCount / DRAPE_STRIP_LANES) lanes_with[place] = 0u;
  PhaseBarrier();
  if (flag && place < kLaneCount) atomicOr(lanes_with[LaneGroup()], 1u << Lane());
  PhaseBarrier();
}

uint LanesWith(bool flag) {
  FlagLanes(flag);
  return lanes_with[LaneGroup()];
}

bool HasAnyLane(bool flag) {
  FlagLanes(flag);
  uint any_lane = 0u;
  for (uint group = 0u; group < kLaneCount / DRAPE_STRIP_LANES; ++group) any_lane |= lanes_with[group];
  return any_lane != 0u;
}

#endif

#endif
