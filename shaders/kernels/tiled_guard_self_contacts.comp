// Kernel `tiled_guard_self_contacts`: stage guard_self_contacts, after `integrate`: no pair passes through itself
// within the substep, and what touches has no velocity towards the other side (method.md, equations 53 to 55). One
// work group = one cloth; an invocation takes every LOCAL_SIZE-th particle or pair. Reads Models, Parameters, Scratch;
// writes Scratch (positions [m], velocities: v [m/s], with two steps the state before), Statuses (contact_pairs,
// contacts_failed, contacts_given_up).
#define COUNTS_IN_SCRATCH
#define SOLVES_IN_SCRATCH
#include "stages/self_contact_search.glsl"
#include "stages/self_contact_zones.glsl"

layout(local_size_x = LOCAL_SIZE) in;

layout(location = DRAPE_UNIFORM_SUBSTEP) uniform uint substep_index;

// As in server/solver/self_contact/planar_guard.cpp and self_contacts.cpp.
const uint kPushRounds = 8u;
const uint kMaxZoneRounds = 1000u;
const uint kMostSearches = 4u;
const float kDriftGrowth = 2.0;
// Fewer than on cpu: here the drift makes each list longer.
const float kMaxDriftScale = 2.0;
const float kEndRounding = 0.984375;

// How far particles are from where the search expected them, relative to each other [m]; below 0: a place is not a
// finite number.
float DriftOfAll() {
  vec3 low = vec3(kMost);
  vec3 high = vec3(-kMost);
  bool is_finite = true;
  precise float seconds = float(since_search + 1u) * cloth.step.h;
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    precise vec3 moved = Position(i) - FoundPosition(i);
    vec3 drifted = AddScaled(moved, -seconds, FoundVelocity(i));
    is_finite = is_finite && IsFinite(drifted.x) && IsFinite(drifted.y) && IsFinite(drifted.z);
    low = min(low, drifted);
    high = max(high, drifted);
  }
  if (is_finite) {
    OfferRange(low, high);
  } else {
    OfferBits(6u, 1u);
  }
  EndOffers();
  return Largest(6u) != 0u ? -1.0 : LargestDifference();
}

// Along the normal at the start, or along that at the end.
bool IsApart(uint k) {
  bool are_edges = (PairFlags(k) & kAreEdges) != 0u;
  uvec4 particles = PairParticles(k);
  precise float core = CoreOf(k) * kEndRounding;
  Corners ends = CornersAtEnd(particles);
  if (GapAlong(are_edges, ends, PairVector(kNormalField, k)) >= core) return true;
  vec3 difference = Closest(are_edges, ends).difference;
  float distance = Length(difference);
  if (!(distance >= core)) return false;
  vec3 normal = Quotient(difference, distance);
  return GapAlong(are_edges, CornersAtStart(particles), normal) > 0.0 && GapAlong(are_edges, ends, normal) >= core;
}

// Whether pair k may come nearer than its core by the ways of its particles. Looks at it if that was not done yet.
bool MayPass(uint k, inout bool is_new) {
  uint flags = PairFlags(k);
  if ((flags & kLeftAlone) != 0u) return false;
  bool are_edges = (flags & kAreEdges) != 0u;
  uvec4 particles = PairParticles(k);
  float way = Length(LargestDifferences(are_edges, Ways(particles)));
  if ((flags & kActive) == 0u) {
    precise float reach = way + CORE_SHARE * PairNumber(kTouchField, k);
    if (BoxGap(are_edges, CornersAtStart(particles)) > reach) return false;
    if (!Look(k)) return false;
    precise float left = PairNumber(kGapField, k) - way;
    if (left > CoreOf(k)) return false;
    SetPairFlags(k, PairFlags(k) | kActive);
    is_new = true;
    return true;
  }
  precise float left = PairNumber(kGapField, k) - way;
  return !(left > CoreOf(k));
}

// The corner of the first primitive that is lowest along the normal and that of the second one that is highest are
// pushed apart.
void PushApart(uint k) {
  bool are_edges = (PairFlags(k) & kAreEdges) != 0u;
  uvec4 particles = PairParticles(k);
  vec3 normal = PairVector(kNormalField, k);
  Corners ends = CornersAtEnd(particles);
  precise vec3 to_b = ends.b - ends.a;
  precise vec3 to_c = ends.c - ends.a;
  precise vec3 to_d = ends.d - ends.a;
  vec4 heights = vec4(0.0, Dot(normal, to_b), Dot(normal, to_c), Dot(normal, to_d));
  uint i = particles.x;
  float low = heights.x;
  if (are_edges && heights.y < low) {
    i = particles.y;
    low = heights.y;
  }
  uint j = are_edges ? particles.z : particles.y;
  float high = are_edges ? heights.z : heights.y;
  if (!are_edges && heights.z > high) {
    j = particles.z;
    high = heights.z;
  }
  if (heights.w > high) {
    j = particles.w;
    high = heights.w;
  }
  float w_i = InverseMass(i);
  float w_j = InverseMass(j);
  precise float w = w_i + w_j;
  if (w == 0.0) return;
  precise float missing = CoreOf(k) - (low - high);
  if (missing <= 0.0) return;  // others have pushed them
  precise vec3 push = Quotient(missing, w) * normal;
#ifdef HAS_IMPULSES
  if (IsTold(w_i)) PullExactly(i, impulse_weight * cloth.step.inverse_h, push);
  if (IsTold(w_j)) PullExactly(j, impulse_weight * cloth.step.inverse_h, -push);
#endif
  if (w_i != 0.0) {
    SetPosition(i, AddScaled(Position(i), w_i, push));
    SetVelocity(i, AddScaled(Velocity(i), w_i * cloth.step.inverse_h, push));
  }
  if (w_j != 0.0) {
    SetPosition(j, AddScaled(Position(j), -w_j, push));
    SetVelocity(j, AddScaled(Velocity(j), -w_j * cloth.step.inverse_h, push));
  }
  SetPairFlags(k, PairFlags(k) | kHit);
}

// What a look at all pairs is for. Each function that looks at pairs or lets them take turns is called in one place,
// since compilers of shaders copy functions to their calls.
const uint kForMore = 0u;    // which may pass and were not looked at yet
const uint kForPushes = 1u;  // which are not apart, of those that may pass
const uint kForZones = 2u;   // which are not apart, of all that were looked at
const uint kForStops = 3u;   // which have hit

// Whether there are any: new ones, ones that wait for a turn, ones that have got planes.
bool ExaminePairs(uint purpose) {
  ClearPending();
  bool has_any = false;
  CountLoop(pair_count);
  FOR_EACH(k, 0u, pair_count) {
    uint flags = PairFlags(k);
    if ((flags & kLeftAlone) != 0u) continue;
    bool is_new = false;
    bool is_meant = false;
    if (purpose == kForStops) {
      is_meant = (flags & (kActive | kHit)) == (kActive | kHit) && PairNumber(kInverseMassField, k) != 0.0;
    } else if (purpose == kForZones) {
      is_meant = (flags & (kActive | kHasPlanes)) == kActive;
    } else {
      is_meant = MayPass(k, is_new);
    }
    if (purpose == kForMore) {
      has_any = has_any || is_new;
      continue;
    }
    if (!is_meant || (purpose != kForStops && IsApart(k))) continue;
    has_any = true;
    if (purpose == kForZones) {
      SetPairFlags(k, PairFlags(k) | kHasPlanes | kHit);
    } else {
      AddPending(k);
    }
  }
  return IsAny(has_any);
}

void BeginZones() {
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) {
    SetScratchVector(contact.wanted + 3u * i, Position(i));
    scratch_words[contact.zones + i] = kNone;
  }
  CountLoop(pair_count);
  FOR_EACH(k, 0u, pair_count) SetPairFlags(k, PairFlags(k) & ~kHasPlanes);
  EndPhase();
}

// Where pins forced a pair through itself, its zone could not help.
void TestZones() {
  CountLoop(pair_count);
  FOR_EACH(k, 0u, pair_count) {
    uint flags = PairFlags(k);
    if ((flags & kHasPlanes) == 0u) continue;
    bool are_edges = (flags & kAreEdges) != 0u;
    float gap = GapAlong(are_edges, CornersAtEnd(PairParticles(k)), PairVector(kNormalField, k));
    // All writers write the same.
    if (!(gap > 0.0)) statuses[status_index].contacts_failed = 1u;
  }
  EndPhase();
}

#ifdef HAS_TWO_STEPS
// What landed goes on as if it had always had the velocity that the hit left (method.md, equation 55).
void ForgetLanding(uint k) {
  uvec4 particles = PairParticles(k);
  vec4 weights = PairWeights(k);
  vec4 w = InverseMasses(particles);
  uint velocities = cloth.scratch.previous_velocities;
  uint positions = cloth.scratch.previous_positions;
  Corners v = Corners(ScratchVector(velocities + 3u * particles.x), ScratchVector(velocities + 3u * particles.y),
                      ScratchVector(velocities + 3u * particles.z), ScratchVector(velocities + 3u * particles.w));
  vec3 before = Weighted(weights, v);
  if (!IsLanding(before, PairVector(kNormalField, k))) return;
  vec3 after = Weighted(weights, Velocities(particles));
  float inverse_mass = PairNumber(kInverseMassField, k);
  Corners p = Corners(ScratchVector(positions + 3u * particles.x), ScratchVector(positions + 3u * particles.y),
                      ScratchVector(positions + 3u * particles.z), ScratchVector(positions + 3u * particles.w));
  precise vec3 way = Weighted(weights, CornersAtEnd(particles)) - Weighted(weights, p);
  precise vec3 faster = after - before;
  precise vec3 longer = way - cloth.step.h * after;
  vec3 of_velocity = Quotient(faster, inverse_mass);
  vec3 of_position = Quotient(longer, inverse_mass);
#ifdef HAS_IMPULSES
  PullPair(particles, weights, w, -memory_weight, of_velocity);
#endif
  if (w.x != 0.0) {
    SetPrevious(particles.x, Changed(p.a, weights.x, w.x, of_position), Changed(v.a, weights.x, w.x, of_velocity));
  }
  if (w.y != 0.0) {
    SetPrevious(particles.y, Changed(p.b, weights.y, w.y, of_position), Changed(v.b, weights.y, w.y, of_velocity));
  }
  if (w.z != 0.0) {
    SetPrevious(particles.z, Changed(p.c, weights.z, w.z, of_position), Changed(v.c, weights.z, w.z, of_velocity));
  }
  if (w.w != 0.0) {
    SetPrevious(particles.w, Changed(p.d, weights.w, w.w, of_position), Changed(v.d, weights.w, w.w, of_velocity));
  }
}
#endif

// What touches has no velocity along the normal, and friction has its part of the impulse. Of what lands only the last
// round can tell whether it slides on.
void StopTouching(uint k, bool is_last) {
  uvec4 particles = PairParticles(k);
  vec4 weights = PairWeights(k);
  vec3 normal = PairVector(kNormalField, k);
  float push = PairNumber(kPushField, k);
  Corners v = Velocities(particles);
  vec3 relative = Weighted(weights, v);
  float speed = Dot(relative, normal);
  // No more than the pair itself has pushed is taken back.
  float change = max(-speed, -push);
  precise float left = push + change;
  push = max(left, 0.0);
  SetPairNumber(kPushField, k, push);
  precise vec3 velocity_change = change * normal;
  if (contact.friction_static > 0.0) {
    vec3 tangent_before = PairVector(kTangentField, k);
    precise vec3 sliding = relative - speed * normal;
    precise vec3 stopping = tangent_before - sliding;
    float slides = PairNumber(kSlidingField, k);
    float press = max(push, WeightPush());
    if (is_last && (PairFlags(k) & kLands) != 0u) {
      precise float rest = Length(stopping) - contact.friction_static * push;
      slides = rest;
      press = WeightPush();
    }
    vec3 tangent = PairFriction(Slips(slides, press), stopping, push);
    velocity_change += tangent - tangent_before;
    SetPairVector(kTangentField, k, tangent);
  }
  vec4 w = InverseMasses(particles);
  ApplyToVelocities(particles, weights, w, v, Quotient(velocity_change, PairNumber(kInverseMassField, k)));
}

// Rounds of stops: many pairs share the particles of what lands, and one round takes from some what others gave. In
// uniform control flow.
uint StopRounds() {
  bool lands = false;
  CountLoop(shared_ordered_count);
  FOR_EACH(o, 0u, shared_ordered_count) {
    lands = lands || (PairFlags(scratch_words[contact.order + o]) & kLands) != 0u;
  }
  return IsAny(lands) && !IsOutOfPasses() ? uint(DRAPE_CONTACT_LANDING_ROUNDS) : 1u;
}

// Pairs that wait push each other apart, or stop.
void SolvePending(uint purpose) {
  uint turns = TakeTurns();
  uint stops = purpose == kForStops ? StopRounds() : 0u;
  uint rounds = max(stops, 1u);
#ifdef HAS_TWO_STEPS
  if (purpose == kForStops && IsTwoStep()) ++rounds;
#endif
  for (uint pass = 0u; pass < rounds; ++pass) {
    for (uint turn = 0u; turn < turns; ++turn) {
      uint begin = TurnBegin(turn);
      uint end = TurnEnd(turn);
      CountLoop(end - begin);
      FOR_EACH(o, begin, end) {
        uint k = scratch_words[contact.order + o];
        if (purpose != kForStops) {
          PushApart(k);
        } else if (pass < stops) {
          if (pass == 0u || (PairFlags(k) & kLands) != 0u) StopTouching(k, pass > 0u && pass + 1u == stops);
#ifdef HAS_TWO_STEPS
        } else {
          ForgetLanding(k);
#endif
        }
      }
      EndPhase();
    }
  }
}

// Rounds of: look for more pairs, after a new search if particles have drifted too far; push those that are not apart;
// stop in zones what still is not; in the end, what touches stops. Where that takes too long, all particles move alike.
void Guard() {
  uint purpose = kForMore;
  uint search_round = 0u;
  uint push_round = 0u;
  uint zone_round = 0u;
  bool has_drifted = false;
  while (true) {
    uint change = 0u;
    bool has_any = false;
    if (purpose == kForMore) {
      float drifted = DriftOfAll();
      if (drifted < 0.0) return;  // the cloth will be faulted
      has_drifted = drifted > drift && given_up < uint(DRAPE_CONTACT_MOST_GIVEN_UP);
      if (has_drifted && search_round <= kMostSearches && !IsOutOfPasses()) {
        drift_scale = min(drift_scale * kDriftGrowth, kMaxDriftScale);
        SearchWays();
      } else if (has_drifted) {
        change = kAsOne;
      }
      if (!has_all_pairs) change = kAsOne;
    }
    if (purpose != kForStops && IsOutOfPasses()) change = kAsOne;
    if (change == 0u) has_any = ExaminePairs(purpose);
    uint turns_for = kForMore;
    bool goes_on = change == 0u;
    if (goes_on && purpose == kForMore) {
      bool is_done = search_round > 0u && !has_drifted && !has_any;
      if (!is_done && search_round > kMostSearches) change = kAsOne;
      purpose = is_done ? kForStops : kForPushes;
      push_round = 0u;
    } else if (goes_on && purpose == kForPushes) {
      if (has_any && push_round < kPushRounds) {
        ++push_round;
        turns_for = kForPushes;
      } else if (push_round > 0u) {
        purpose = kForZones;
        zone_round = 0u;
        BeginZones();
      } else if (has_drifted) {
        purpose = kForMore;
        ++search_round;
      } else {
        purpose = kForStops;
      }
    } else if (goes_on && purpose == kForZones) {
      if (has_any && zone_round < kMaxZoneRounds) {
        ++zone_round;
        change = JoinZones() ? kToMove : kAsOne;
      } else {
        change = zone_round > 0u ? kToEnd : 0u;
        purpose = kForMore;
        ++search_round;
      }
    } else if (goes_on) {
      turns_for = kForStops;
    }
    if (turns_for != kForMore) SolvePending(turns_for);
    if (change != 0u) ChangeZones(change);
    if (change == kToEnd) TestZones();
    if (change == kAsOne) substeps_left = 0u;
    if (change == kAsOne && !has_all_pairs) given_up = min(given_up + 1u, uint(DRAPE_CONTACT_MOST_GIVEN_UP));
    if (turns_for == kForStops) given_up = 0u;
    if (change == kAsOne || turns_for == kForStops) return;
  }
}

void main() {
  OpenCloth(gl_WorkGroupID.y);
  if (substep_index >= cloth.step.substeps) return;
  LoadSelfContacts();
  LoadContactState();
  BeginSubstep(substep_index);
  BeginOffers();
  Guard();
  StoreContactState();
}
