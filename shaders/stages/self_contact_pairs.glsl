// Stages find_self_contacts and solve_self_contacts of one pair, and the turns that pairs take.
#include "interface/self_contact_search.h"
#include "stages/exact_pulls.glsl"
#include "stages/self_contacts.glsl"

// As in server/solver/self_contact/self_contacts.cpp and contact_pair.cpp.
const float kWayMargin = 1.25;
const float kTrueShare = 0.9375;

// Finds the normal, the weights, the inverse mass and the gap where the substep began, and begins its impulses. False:
// the primitives touch or cross, as far as single precision can tell; the pair is then left alone.
bool Look(uint k) {
  uint flags = PairFlags(k);
  bool are_edges = (flags & kAreEdges) != 0u;
  uvec4 particles = PairParticles(k);
  Corners p = CornersAtStart(particles);
  ClosestPoints closest = Closest(are_edges, p);
  float distance = Length(closest.difference);
  vec3 normal = vec3(0.0);
  float gap = 0.0;
  if (distance > 0.0) {
    normal = Quotient(closest.difference, distance);
    gap = GapAlong(are_edges, p, normal);
  }
  precise float least = kTrueShare * distance;
  // Rounding has spoilt the direction of points that are very near.
  if (!(gap > least)) {
    vec3 across = DirectionAcross(are_edges, p, closest.difference);
    float gap_across = GapAlong(are_edges, p, across);
    if (gap_across > gap) {
      normal = across;
      gap = gap_across;
    }
  }
  bool is_apart = gap > 0.0;
  vec4 w = InverseMasses(particles);
  precise vec4 of_each = closest.weights * closest.weights * w;
  precise float inverse_mass = of_each.x + of_each.y + of_each.z + of_each.w;
  float touch = PairNumber(kTouchField, k);
  precise float risen = gap + cloth.step.max_depenetration;
  precise float height = Dot(normal, Weighted(closest.weights, p)) - touch;
  precise float rounding = TOUCH_ROUND_OFF * 2.0 * (SumOfSizes(p.a) + touch);
  SetPairVector(kNormalField, k, normal);
  SetPairVector(kWeightsField, k, closest.weights.xyz);
  SetPairNumber(kWeightsField + 3u, k, closest.weights.w);
  SetPairNumber(kInverseMassField, k, inverse_mass);
  SetPairNumber(kGapField, k, gap);
  bool is_resting = abs(height) < rounding;
  // Of what has left the bound of rounding only the rest of the way counts.
  precise float ground = min(touch, risen) + (is_resting ? 0.0 : height > 0.0 ? rounding : -rounding);
  SetPairNumber(kFloorField, k, ground);
  SetPairNumber(kPushField, k, 0.0);
  SetPairVector(kTangentField, k, vec3(0.0));
  SetPairNumber(kSlidingField, k, 0.0);
  flags = (flags & kAreEdges) | (is_apart ? 0u : kLeftAlone) | (is_resting ? kResting : 0u);
  SetPairFlags(k, flags);
  return is_apart;
}

bool IsAtBorder(vec4 weights) {
  return weights.x == 0.0 || weights.y == 0.0 || weights.z == 0.0 || weights.w == 0.0;
}

// Whether the normal leans over the way from `at` to `other`.
bool LeansOver(vec3 normal, uint at, uint other) {
  precise vec3 side = Start(other) - Start(at);
  float along = Dot(normal, side);
  precise float least = DRAPE_CONTACT_LEAST_LEAN * DRAPE_CONTACT_LEAST_LEAN * Dot(side, side);
  precise float squared = along * along;
  return along > 0.0 && squared > least;
}

// Whether a triangle beside that of pair k is nearer to its vertex (method.md, «Borders»). At most most_around passes.
bool IsCovered(uint k) {
  vec4 weights = PairWeights(k);
  if ((PairFlags(k) & kAreEdges) != 0u || !IsAtBorder(weights)) return false;
  uvec4 particles = PairParticles(k);
  vec3 normal = PairVector(kNormalField, k);
  // The nearest point is the corner `at`, or between that and `end`.
  uint at = kNone;
  uint end = kNone;
  uint beside = kNone;
  for (int corner = 1; corner < 4; ++corner) {
    if (weights[corner] == 0.0) {
      beside = particles[corner];
    } else if (at == kNone) {
      at = particles[corner];
    } else {
      end = particles[corner];
    }
  }
  if (at == kNone) return false;
  uint first = models[contact.around_offsets + at];
  uint last = models[contact.around_offsets + at + 1u];
  bool is_covered = false;
  for (uint t = first; t < last && !is_covered; ++t) {
    uint i = models[contact.corners_around + 2u * t];
    uint j = models[contact.corners_around + 2u * t + 1u];
    if (end == kNone) {
      is_covered = LeansOver(normal, at, i) || LeansOver(normal, at, j);
    } else if (i == end || j == end) {
      uint other = i == end ? j : i;
      is_covered = other != beside && LeansOver(normal, at, other);
    }
  }
  return is_covered;
}

// Faster towards the other side than what rests or slides could be.
bool IsLanding(vec3 velocity, vec3 normal) {
  precise float slowest = cloth.step.slowest_landing + GRAZING_SINE * Length(velocity);
  return -Dot(velocity, normal) > slowest;
}

// Of a pair that may push, before the prediction: what it needs to know of the start of the substep.
void BeginPair(uint k) {
  if (IsCovered(k)) SetPairFlags(k, PairFlags(k) | kCovered);
  if (!(contact.friction_static > 0.0)) return;
  vec3 normal = PairVector(kNormalField, k);
  vec3 relative = Weighted(PairWeights(k), Velocities(PairParticles(k)));
  if (IsLanding(relative, normal)) {
    SetPairFlags(k, PairFlags(k) | kLands);
    return;
  }
  float speed = Dot(relative, normal);
  precise vec3 sliding = relative - speed * normal;
  SetPairNumber(kSlidingField, k, Length(sliding));
}

float CoreOf(uint k) {
  precise float core = CORE_SHARE * PairNumber(kTouchField, k);
  return min(core, PairNumber(kGapField, k));
}

shared uint shared_pending_count;

// In uniform control flow.
void ClearPending() {
  EndPhase();
  if (gl_LocalInvocationID.x == 0u) shared_pending_count = 0u;
  EndPhase();
}
void AddPending(uint k) { scratch_words[contact.pending + atomicAdd(shared_pending_count, 1u)] = k; }

// Pairs that wait are solved in turns. In each those come that have the first key of all that wait at each of their
// free particles: so those of a turn share no free particle, and neither the order of the list nor that of the
// invocations matters. Reversed bits: pairs that are neighbours in the list share particles, and would wait for each
// other in a long row.
uint KeyOf(uint k) { return bitfieldReverse(k); }

void Claim(uint k) {
  uvec4 particles = PairParticles(k);
  vec4 w = InverseMasses(particles);
  uint key = KeyOf(k);
  if (w.x != 0.0) atomicMin(scratch_words[contact.claims + particles.x], key);
  if (w.y != 0.0) atomicMin(scratch_words[contact.claims + particles.y], key);
  if (w.z != 0.0) atomicMin(scratch_words[contact.claims + particles.z], key);
  if (w.w != 0.0) atomicMin(scratch_words[contact.claims + particles.w], key);
}
bool IsFirst(uint k) {
  uvec4 particles = PairParticles(k);
  vec4 w = InverseMasses(particles);
  uint key = KeyOf(k);
  return (w.x == 0.0 || scratch_words[contact.claims + particles.x] == key) &&
         (w.y == 0.0 || scratch_words[contact.claims + particles.y] == key) &&
         (w.z == 0.0 || scratch_words[contact.claims + particles.z] == key) &&
         (w.w == 0.0 || scratch_words[contact.claims + particles.w] == key);
}
void Release(uint k) {
  uvec4 particles = PairParticles(k);
  vec4 w = InverseMasses(particles);
  if (w.x != 0.0) scratch_words[contact.claims + particles.x] = kNone;
  if (w.y != 0.0) scratch_words[contact.claims + particles.y] = kNone;
  if (w.z != 0.0) scratch_words[contact.claims + particles.z] = kNone;
  if (w.w != 0.0) scratch_words[contact.claims + particles.w] = kNone;
}

const uint kTaken = 0x80000000u;  // a pair of the list that has had its turn
shared uint shared_ordered_count;

// The turns of the pairs that wait, in `order` and `turns`; how many. What has no turn within the limits is not
// solved: impulses may be left out, the guard never is. In uniform control flow.
uint TakeTurns() {
  if (gl_LocalInvocationID.x == 0u) shared_ordered_count = 0u;
  CountLoop(cloth.particle_count);
  FOR_EACH(i, 0u, cloth.particle_count) scratch_words[contact.claims + i] = kNone;
  EndPhase();
  uint waiting = shared_pending_count;
  uint done = 0u;
  uint turn = 0u;
  while (done < waiting && turn < DRAPE_CONTACT_TURNS && !IsOutOfPasses()) {
    CountLoop(waiting);
    CountLoop(waiting);
    FOR_EACH(p, 0u, waiting) {
      uint k = scratch_words[contact.pending + p];
      if ((k & kTaken) == 0u) Claim(k);
    }
    EndPhase();
    FOR_EACH(p, 0u, waiting) {
      uint k = scratch_words[contact.pending + p];
      if ((k & kTaken) != 0u || !IsFirst(k)) continue;
      scratch_words[contact.pending + p] = k | kTaken;
      scratch_words[contact.order + atomicAdd(shared_ordered_count, 1u)] = k;
    }
    EndPhase();
    uint end = shared_ordered_count;
    CountLoop(end - done);
    FOR_EACH(o, done, end) Release(scratch_words[contact.order + o]);
    if (gl_LocalInvocationID.x == 0u) scratch_words[contact.turns + turn] = end;
    EndPhase();
    done = end;
    ++turn;
  }
  return turn;
}

uint TurnBegin(uint turn) { return turn == 0u ? 0u : scratch_words[contact.turns + turn - 1u]; }
uint TurnEnd(uint turn) { return scratch_words[contact.turns + turn]; }

// Whether what slides at `speed` [m/s] has the dynamic friction, where each substep presses by `push` [m/s].
bool Slips(float speed, float push) {
  precise float fastest = DRAPE_CONTACT_SLIP_SUBSTEPS * contact.friction_static * push;
  return speed > fastest;
}

// Coulomb's law: the impulse across the normal nearest to the one that stops the sliding.
vec3 PairFriction(bool slips, vec3 stopping, float push) {
  float size = Length(stopping);
  precise float limit = (slips ? contact.friction_dynamic : contact.friction_static) * push;
  if (size <= limit) return stopping;
  precise vec3 least = stopping * Quotient(limit, size);
  return least;
}

float WeightPush() {
  precise float push = contact.gravity * cloth.step.h;
  return push;
}

// By which a particle's vector changes where opposite impulses change the weighted sum of the pair.
vec3 Changed(vec3 vector, float weight, float inverse_mass, vec3 impulse) {
  precise float share = weight * inverse_mass;
  return AddScaled(vector, share, impulse);
}

// Changes the relative velocity of the pair.
void ApplyToVelocities(uvec4 particles, vec4 weights, vec4 w, Corners u, vec3 impulse) {
#ifdef HAS_IMPULSES
  PullPair(particles, weights, w, impulse_weight, impulse);
#endif
  if (w.x != 0.0) SetVelocity(particles.x, Changed(u.a, weights.x, w.x, impulse));
  if (w.y != 0.0) SetVelocity(particles.y, Changed(u.b, weights.y, w.y, impulse));
  if (w.z != 0.0) SetVelocity(particles.z, Changed(u.c, weights.z, w.z, impulse));
  if (w.w != 0.0) SetVelocity(particles.w, Changed(u.d, weights.w, w.w, impulse));
}

// One sweep over pair k (method.md, equations 51 and 52): positions are b, velocities u. The square of the change of
// the relative velocity.
float SolvePair(uint k) {
  float inverse_mass = PairNumber(kInverseMassField, k);
  if (inverse_mass == 0.0) return 0.0;
  uvec4 particles = PairParticles(k);
  vec4 weights = PairWeights(k);
  vec3 normal = PairVector(kNormalField, k);
  uint flags = PairFlags(k);
  float interval = substep.interval;
  Corners base = CornersAtEnd(particles);
  Corners u = Velocities(particles);
  vec3 relative = Weighted(weights, u);
  precise vec3 move = interval * relative;
  precise float error;
  if ((flags & kResting) != 0u) {
    // Of what rests the way counts, with all its digits.
    Corners ways = Ways(particles);
    precise vec3 way = weights.x * ways.a + weights.y * ways.b + weights.z * ways.c + weights.w * ways.d;
    error = Dot(normal, way + move);
  } else {
    error = Dot(normal, Weighted(weights, base) + move) - PairNumber(kFloorField, k);
  }
  float before = PairNumber(kPushField, k);
  if (before == 0.0 && (error >= 0.0 || (flags & kCovered) != 0u)) return 0.0;
  if (error < 0.0 && (flags & kResting) == 0u && IsAtBorder(weights)) {
    // A normal that leans over a border is true only where it was found: the distance at the end counts, if that is
    // still on the same side.
    precise vec3 end_a = base.a + interval * u.a;
    precise vec3 end_b = base.b + interval * u.b;
    precise vec3 end_c = base.c + interval * u.c;
    precise vec3 end_d = base.d + interval * u.d;
    vec3 difference = Closest((flags & kAreEdges) != 0u, Corners(end_a, end_b, end_c, end_d)).difference;
    if (Dot(normal, difference) > 0.0) {
      precise float true_error = Length(difference) - PairNumber(kFloorField, k);
      error = max(error, true_error);
    }
    if (error >= 0.0 && before == 0.0) return 0.0;
  }
  precise float wanted = before - Quotient(error, interval);
  float push = max(wanted, 0.0);
  precise float change = push - before;
  precise vec3 velocity_change = change * normal;
  if (contact.friction_static > 0.0) {
    precise vec3 after = relative + velocity_change;
    float normal_speed = Dot(after, normal);
    precise vec3 sliding = after - normal_speed * normal;
    float whole = push;
#ifdef HAS_TWO_STEPS
    // With two steps nothing is left of the speed along the normal.
    whole = max(push - normal_speed, 0.0);
#endif
    vec3 tangent_before = PairVector(kTangentField, k);
    precise vec3 stopping = tangent_before - sliding;
    vec3 tangent = PairFriction(Slips(PairNumber(kSlidingField, k), max(whole, WeightPush())), stopping, whole);
    velocity_change += tangent - tangent_before;
    SetPairVector(kTangentField, k, tangent);
  }
  SetPairNumber(kPushField, k, push);
  if (push > 0.0) SetPairFlags(k, flags | kHit);
  ApplyToVelocities(particles, weights, InverseMasses(particles), u, Quotient(velocity_change, inverse_mass));
  return Dot(velocity_change, velocity_change);
}
