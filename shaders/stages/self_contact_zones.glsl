// Stage guard_self_contacts: what impulses could not keep apart is stopped at planes, in zones
// (server/solver/method.md; server/solver/self_contact/planar_guard.h). Sums over a zone are in fixed point, zones are
// named by their smallest particle: nothing depends on the order of the invocations.
#include "lib/fixed_sum.glsl"
#include "stages/self_contact_pairs.glsl"

const uint kMassSum = 0u;
const uint kWaySum = 1u;       // of free particles, times mass; xyz
const uint kPinWaySum = 4u;    // of pins; xyz
const uint kVelocitySum = 7u;  // of free particles, times mass; xyz
const uint kPreviousSum = 10u;  // the same of the velocities before
const uint kShiftSum = 13u;    // what stopping takes away, times mass; xyz
const uint kPinCount = 32u;    // word of a count

uint SumWord(uint zone, uint which) { return contact.sums + DRAPE_CONTACT_SUM_WORDS * zone + 2u * which; }
void AddToSum(uint zone, uint which, float share) {
  uvec2 words = FixedWords(share);
  atomicAdd(scratch_words[SumWord(zone, which)], words.x);
  atomicAdd(scratch_words[SumWord(zone, which) + 1u], words.y);
}
void AddToSums(uint zone, uint which, vec3 shares) {
  AddToSum(zone, which, shares.x);
  AddToSum(zone, which + 1u, shares.y);
  AddToSum(zone, which + 2u, shares.z);
}
float SumOf(uint zone, uint which) {
  return FixedSum(uvec2(scratch_words[SumWord(zone, which)], scratch_words[SumWord(zone, which) + 1u]));
}
vec3 SumsOf(uint zone, uint which) {
  return vec3(SumOf(zone, which), SumOf(zone, which + 1u), SumOf(zone, which + 2u));
}
uint PinCountWord(uint zone) { return contact.sums + DRAPE_CONTACT_SUM_WORDS * zone + kPinCount; }
// Of all zones; a barrier comes before the first sum.
void ClearSums() {
  uint words = DRAPE_CONTACT_SUM_WORDS * cloth.particle_count;
  CountLoop(words);
  FOR_EACH(word, 0u, words) scratch_words[contact.sums + word] = 0u;
}

uint ZoneOf(uint i) { return scratch_words[contact.zones + i]; }
bool IsMember(uint i) { return ZoneOf(i) != kNone; }
vec3 Wanted(uint i) { return ScratchVector(contact.wanted + 3u * i); }
vec3 WantedWay(uint i) {
  precise vec3 way = Wanted(i) - Start(i);
  return way;
}
float LargestPart(vec3 v) { return max(max(abs(v.x), abs(v.y)), abs(v.z)); }

// Bounds of what is added up; not 0.
struct Scales {
  float mass;
  float way;
  float velocity;
  float previous;
};

const float kLeast = 1e-30;

Scales FindScales() {
  vec4 mine = vec4(0.0);
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    if (!IsMember(i)) continue;
    float w = InverseMass(i);
    mine.x = max(mine.x, w == 0.0 ? 0.0 : 1.0 / w);
    mine.y = max(mine.y, LargestPart(WantedWay(i)));
    if (w == 0.0) continue;
    precise vec3 way = Position(i) - Start(i);
    mine.y = max(mine.y, LargestPart(way));
    mine.z = max(mine.z, LargestPart(Velocity(i)));
#ifdef HAS_TWO_STEPS
    mine.w = max(mine.w, LargestPart(ScratchVector(cloth.scratch.previous_velocities + 3u * i)));
#endif
  }
  OfferSize(0u, mine.x);
  OfferSize(1u, mine.y);
  OfferSize(2u, mine.z);
  OfferSize(3u, mine.w);
  EndOffers();
  return Scales(max(LargestSize(0u), kLeast), max(LargestSize(1u), kLeast), max(LargestSize(2u), kLeast),
                max(LargestSize(3u), kLeast));
}

// The mean way of a zone, that of its pins if it has any.
vec3 ZoneWay(uint zone, Scales scales) {
  uint pins = scratch_words[PinCountWord(zone)];
  precise vec3 pin_way = scales.way * Quotient(SumsOf(zone, kPinWaySum), float(max(pins, 1u)));
  precise vec3 way = scales.way * Quotient(SumsOf(zone, kWaySum), SumOf(zone, kMassSum));
  return pins > 0u ? pin_way : way;
}

// The share of a bound, between -1 and 1 also where the quotient is rounded up.
vec3 Shares(vec3 value, float bound) { return clamp(Quotient(value, bound), -1.0, 1.0); }

// What is done with sums over zones: their particles are stopped at planes; they end, with velocities that follow; or
// all particles are one zone, which moves as one.
const uint kToMove = 1u;
const uint kToEnd = 2u;
const uint kAsOne = 3u;

float MassShare(float w, Scales scales) { return min(1.0 / w / scales.mass, 1.0); }

void AddUp(uint purpose, Scales scales) {
  ClearSums();
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    scratch_words[contact.shares + i] = floatBitsToUint(1.0);
    scratch_words[contact.pin_pushes + 3u * i] = 0u;
    scratch_words[contact.pin_pushes + 3u * i + 1u] = 0u;
    scratch_words[contact.pin_pushes + 3u * i + 2u] = 0u;
  }
  EndPhase();
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    if (!IsMember(i)) continue;
    uint zone = ZoneOf(i);
    float w = InverseMass(i);
    precise vec3 way = (purpose == kToEnd ? Position(i) : Wanted(i)) - Start(i);
    vec3 share = Shares(way, scales.way);
    if (w == 0.0) {
      AddToSums(zone, kPinWaySum, share);
      atomicAdd(scratch_words[PinCountWord(zone)], 1u);
      continue;
    }
    float mass = MassShare(w, scales);
    AddToSum(zone, kMassSum, mass);
    AddToSums(zone, kWaySum, mass * share);
    AddToSums(zone, kVelocitySum, mass * Shares(Velocity(i), scales.velocity));
#ifdef HAS_TWO_STEPS
    vec3 previous = ScratchVector(cloth.scratch.previous_velocities + 3u * i);
    AddToSums(zone, kPreviousSum, mass * Shares(previous, scales.previous));
#endif
  }
  EndPhase();
}

// Of pushes by pins, in units of the bound of ways.
const float kPushUnits = 262144.0;

vec3 PinPush(uint i) {
  uint word = contact.pin_pushes + 3u * i;
  return vec3(float(int(scratch_words[word])), float(int(scratch_words[word + 1u])),
              float(int(scratch_words[word + 2u])));
}

void LimitWay(uint i, bool is_first, float height, float way, vec2 planes, vec3 normal, float way_bound) {
  if (InverseMass(i) == 0.0) return;
  precise float room = is_first ? height - planes.x : planes.y - height;
  float approach = is_first ? -way : way;
  if (room < 0.0) {  // only beside pins
    atomicMin(scratch_words[contact.shares + i], 0u);
    precise vec3 push = Quotient(is_first ? -room : room, way_bound) * normal * kPushUnits;
    atomicAdd(scratch_words[contact.pin_pushes + 3u * i], uint(int(push.x)));
    atomicAdd(scratch_words[contact.pin_pushes + 3u * i + 1u], uint(int(push.y)));
    atomicAdd(scratch_words[contact.pin_pushes + 3u * i + 2u], uint(int(push.z)));
  } else if (approach > room) {
    atomicMin(scratch_words[contact.shares + i], floatBitsToUint(Quotient(room, approach)));
  }
}

// The planes of a pair lie halfway between the primitives at the start, the core apart, and move with the zone; those
// of pins give way to the pins.
void LimitWays(uint k, Scales scales) {
  bool are_edges = (PairFlags(k) & kAreEdges) != 0u;
  uvec4 particles = PairParticles(k);
  vec3 normal = PairVector(kNormalField, k);
  float core = CoreOf(k);
  vec3 zone_way = ZoneWay(ZoneOf(particles.x), scales);
  Corners p = CornersAtStart(particles);
  precise vec3 to_b = p.b - p.a;
  precise vec3 to_c = p.c - p.a;
  precise vec3 to_d = p.d - p.a;
  vec4 heights = vec4(0.0, Dot(normal, to_b), Dot(normal, to_c), Dot(normal, to_d));
  precise vec3 way_a = WantedWay(particles.x) - zone_way;
  precise vec3 way_b = WantedWay(particles.y) - zone_way;
  precise vec3 way_c = WantedWay(particles.z) - zone_way;
  precise vec3 way_d = WantedWay(particles.w) - zone_way;
  vec4 ways = vec4(Dot(normal, way_a), Dot(normal, way_b), Dot(normal, way_c), Dot(normal, way_d));
  float low = are_edges ? min(heights.x, heights.y) : heights.x;
  float high = max(heights.z, heights.w);
  if (!are_edges) high = max(high, heights.y);
  precise float middle = 0.5 * (low + high);
  precise float half_core = 0.5 * core;
  precise float upper = middle + half_core;
  precise float lower = middle - half_core;
  vec4 w = InverseMasses(particles);
  precise vec4 ends = heights + ways;
  if (w.x == 0.0) upper = min(upper, ends.x);
  if (w.y == 0.0 && are_edges) upper = min(upper, ends.y);
  if (w.y == 0.0 && !are_edges) lower = max(lower, ends.y);
  if (w.z == 0.0) lower = max(lower, ends.z);
  if (w.w == 0.0) lower = max(lower, ends.w);
  if (upper < middle) lower = min(lower, upper - core);
  if (lower > middle) upper = max(upper, lower + core);
  vec2 planes = vec2(upper, lower);
  LimitWay(particles.x, true, heights.x, ways.x, planes, normal, scales.way);
  LimitWay(particles.y, are_edges, heights.y, ways.y, planes, normal, scales.way);
  LimitWay(particles.z, false, heights.z, ways.z, planes, normal, scales.way);
  LimitWay(particles.w, false, heights.w, ways.w, planes, normal, scales.way);
}

void MoveZones(Scales scales) {
  CountLoop(pair_count);
  FOR_EACH(k, 0u, pair_count) {
    if ((PairFlags(k) & kHasPlanes) != 0u) LimitWays(k, scales);
  }
  EndPhase();
  // No way relative to the mean is longer than twice the bound along any axis.
  precise float relative_bound = 2.0 * scales.way;
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    float w = InverseMass(i);
    if (!IsMember(i) || w == 0.0) continue;
    uint zone = ZoneOf(i);
    vec3 zone_way = ZoneWay(zone, scales);
    precise vec3 relative = WantedWay(i) - zone_way;
    float share = uintBitsToFloat(scratch_words[contact.shares + i]);
    precise vec3 push = PinPush(i) * (scales.way / kPushUnits);
    precise vec3 end = (Start(i) + zone_way) + (share * relative + push);
    SetPosition(i, end);
    precise vec3 lost = (MassShare(w, scales) * (1.0 - share)) * Shares(relative, relative_bound);
    AddToSums(zone, kShiftSum, lost);
  }
  EndPhase();
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    if (!IsMember(i) || InverseMass(i) == 0.0) continue;
    uint zone = ZoneOf(i);
    if (scratch_words[PinCountWord(zone)] > 0u) continue;
    precise vec3 shift = relative_bound * Quotient(SumsOf(zone, kShiftSum), SumOf(zone, kMassSum));
    SetPosition(i, AddScaled(Position(i), 1.0, shift));
  }
  EndPhase();
}

// The particles of each pair with planes belong to the zone of its smallest one. False: too far from end to end.
bool JoinZones() {
  CountLoop(pair_count);
  FOR_EACH(k, 0u, pair_count) {
    if ((PairFlags(k) & kHasPlanes) == 0u) continue;
    uvec4 i = PairParticles(k);
    atomicMin(scratch_words[contact.zones + i.x], i.x);
    atomicMin(scratch_words[contact.zones + i.y], i.y);
    atomicMin(scratch_words[contact.zones + i.z], i.z);
    atomicMin(scratch_words[contact.zones + i.w], i.w);
  }
  EndPhase();
  while (!IsOutOfPasses()) {
    bool has_changed = false;
    CountLoop(pair_count);
    CountLoop(pair_count);
    // Nobody waits for a turn now: `order` has room for the new zone of each pair.
    FOR_EACH(k, 0u, pair_count) {
      if ((PairFlags(k) & kHasPlanes) == 0u) continue;
      uvec4 i = PairParticles(k);
      uvec4 zones = uvec4(ZoneOf(i.x), ZoneOf(i.y), ZoneOf(i.z), ZoneOf(i.w));
      uint zone = min(min(zones.x, zones.y), min(zones.z, zones.w));
      scratch_words[contact.order + k] = zone;
      has_changed = has_changed || zones.x != zone || zones.y != zone || zones.z != zone || zones.w != zone;
    }
    if (!IsAny(has_changed)) return true;
    FOR_EACH(k, 0u, pair_count) {
      if ((PairFlags(k) & kHasPlanes) == 0u) continue;
      uvec4 i = PairParticles(k);
      uint zone = scratch_words[contact.order + k];
      atomicMin(scratch_words[contact.zones + i.x], zone);
      atomicMin(scratch_words[contact.zones + i.y], zone);
      atomicMin(scratch_words[contact.zones + i.z], zone);
      atomicMin(scratch_words[contact.zones + i.w], zone);
    }
    EndPhase();
  }
  return false;
}

#ifdef HAS_IMPULSES
// The passes of these two are not counted, so that nobody who asks changes what is left out: they are two of the dozen
// loops over all particles that come with each end of zones.
void ClearZonePulls() {
  FOR_EACH(i, 0u, cloth.particle_count) {
    for (uint n = 0u; n < DRAPE_EXACT_WORDS; ++n) scratch_words[ZonePullWord(i) + n] = 0u;
  }
  EndPhase();
}

// What a free particle loses to the pins of its zone [N s].
void PullZone(uint zone, float w, float weight, vec3 change) {
  precise vec3 impulse = weight * change / w;
  AddExactly(ZonePullWord(zone), impulse);
}

// The pins of a zone share it equally.
void PullPinsOfZones() {
  EndPhase();
  FOR_EACH(i, 0u, cloth.particle_count) {
    if (!IsMember(i) || InverseMass(i) != 0.0) continue;
    uint zone = ZoneOf(i);
    precise float share = 1.0 / float(scratch_words[PinCountWord(zone)]);
    PullExactly(i, share, ExactVector(ZonePullWord(zone)));
  }
}
#endif

// A zone that ends: relative to its mean a particle goes on as if it had always flown as it did in this substep; the
// mean keeps its history, so the momentum stays what it was. One that moves as one: by its mean way, or not at all
// beside pins.
void EndZones(uint purpose, Scales scales) {
#ifdef HAS_IMPULSES
  ClearZonePulls();
#endif
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    if (!IsMember(i) || InverseMass(i) == 0.0) continue;
    uint zone = ZoneOf(i);
    bool has_pins = scratch_words[PinCountWord(zone)] > 0u;
    float mass = SumOf(zone, kMassSum);
    precise vec3 zone_way = scales.way * Quotient(SumsOf(zone, kWaySum), mass);
    precise vec3 zone_velocity = scales.velocity * Quotient(SumsOf(zone, kVelocitySum), mass);
    vec3 mean_way = has_pins ? vec3(0.0) : zone_way;
    if (purpose == kAsOne) SetPosition(i, AddScaled(Start(i), 1.0, mean_way));
    precise vec3 way = Position(i) - Start(i);
    precise vec3 faster = (way - mean_way) * cloth.step.inverse_h;
    vec3 relative = purpose == kAsOne ? vec3(0.0) : faster;
    precise vec3 velocity = zone_velocity + relative;
#ifdef HAS_IMPULSES
    precise vec3 stopped = Velocity(i) - relative;
    if (has_pins) PullZone(zone, InverseMass(i), impulse_weight, stopped);
    if (IsTold(InverseMass(i))) {
      precise vec3 change = (has_pins ? relative : velocity) - Velocity(i);
      precise vec3 impulse = change / InverseMass(i);
      PullExactly(i, impulse_weight, impulse);
    }
#endif
    SetVelocity(i, has_pins ? relative : velocity);
#ifdef HAS_TWO_STEPS
    if (purpose == kAsOne || !IsTwoStep()) continue;
    precise vec3 zone_previous = scales.previous * Quotient(SumsOf(zone, kPreviousSum), mass);
    precise vec3 previous = zone_previous + relative;
#ifdef HAS_IMPULSES
    precise vec3 stopped_before = relative - ScratchVector(cloth.scratch.previous_velocities + 3u * i);
    if (has_pins) PullZone(zone, InverseMass(i), memory_weight, stopped_before);
    if (IsTold(InverseMass(i))) {
      vec3 before = ScratchVector(cloth.scratch.previous_velocities + 3u * i);
      precise vec3 change = before - (has_pins ? relative : previous);
      precise vec3 impulse = change / InverseMass(i);
      PullExactly(i, memory_weight, impulse);
    }
#endif
    SetScratchVector(cloth.scratch.previous_velocities + 3u * i, has_pins ? relative : previous);
#endif
  }
#ifdef HAS_IMPULSES
  PullPinsOfZones();
#endif
  EndPhase();
}

// Every particle of every zone from now on.
void JoinAll() {
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    scratch_words[contact.zones + i] = 0u;
    SetScratchVector(contact.wanted + 3u * i, Position(i));
  }
  EndPhase();
}

// Sums over zones, and what is done with them.
void ChangeZones(uint purpose) {
  if (purpose == kAsOne) JoinAll();
  Scales scales = FindScales();
  AddUp(purpose, scales);
  if (purpose == kToMove) {
    MoveZones(scales);
  } else {
    EndZones(purpose, scales);
  }
  if (purpose != kAsOne || gl_LocalInvocationID.x != 0u) return;
  statuses[status_index].contacts_given_up = 1u;
  // Pins may have forced something through the cloth.
  if (scratch_words[PinCountWord(0u)] > 0u) statuses[status_index].contacts_failed = 1u;
}
