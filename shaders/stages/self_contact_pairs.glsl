// Stages find_self_contacts and solve_self_contacts of one pair, and the turns that pairs take.
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
  SetPairNumber(kFloorField, k, min(touch, risen));
  SetPairNumber(kPushField, k, 0.0);
  SetPairVector(kTangentField, k, vec3(0.0));
  flags = (flags & kAreEdges) | (is_apart ? 0u : kLeftAlone) | (abs(height) < rounding ? kResting : 0u);
  SetPairFlags(k, flags);
  return is_apart;
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

// Coulomb's law: the impulse across the normal that static friction can exert, or the dynamic one.
vec3 PairFriction(vec3 wanted, float push) {
  float size = Length(wanted);
  precise float stick = contact.friction_static * push;
  if (size <= stick) return wanted;
  precise float share = Quotient(contact.friction_dynamic * push, size);
  precise vec3 sliding = wanted * share;
  return sliding;
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
  if (error >= 0.0 && before == 0.0) return 0.0;
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
    vec3 tangent = PairFriction(stopping, whole);
    velocity_change += tangent - tangent_before;
    SetPairVector(kTangentField, k, tangent);
  }
  SetPairNumber(kPushField, k, push);
  if (push > 0.0) SetPairFlags(k, flags | kHit);
  ApplyToVelocities(particles, weights, InverseMasses(particles), u, Quotient(velocity_change, inverse_mass));
  return Dot(velocity_change, velocity_change);
}
