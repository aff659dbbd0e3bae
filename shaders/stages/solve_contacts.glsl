// Stages `solve_contacts` and `correct_velocity`. Need the accessors of one plan. Each invocation reads
// and writes only its own particle and that particle's betas and met colliders.
#include "lib/contact.glsl"
#include "stages/collider_reach.glsl"
#include "stages/collider_surface.glsl"
#include "stages/previous.glsl"
#include "stages/rebound.glsl"
#include "stages/substep.glsl"

uint NormalBetaWord(uint collider, uint i) {
  return cloth.scratch.normal_betas + collider * cloth.particle_count + i;
}
// x; y and z follow at distances of particle_count.
uint TangentBetaWord(uint collider, uint i) {
  return cloth.scratch.tangent_betas + 3u * collider * cloth.particle_count + i;
}

#ifdef HAS_FRICTION
vec3 LoadTangentBeta(uint collider, uint i) {
  uint word = TangentBetaWord(collider, i);
  uint stride = cloth.particle_count;
  return vec3(scratch[word], scratch[word + stride], scratch[word + 2u * stride]);
}
void StoreTangentBeta(uint collider, uint i, vec3 beta_t) {
  uint word = TangentBetaWord(collider, i);
  uint stride = cloth.particle_count;
  scratch[word] = beta_t.x;
  scratch[word + stride] = beta_t.y;
  scratch[word + 2u * stride] = beta_t.z;
}
#endif

// The position before the substep of a particle whose b is p.
vec3 StartPosition(uint i, vec3 p) {
#ifdef HAS_TWO_STEPS
  return PreviousPosition(i);
#else
  return p;
#endif
}

// From where a particle, predicted from b, was before the substep to where it will be after it, relative to the
// surface.
vec3 WayOf(Surface surface, uint i, vec3 b, vec3 u) {
  precise vec3 way = substep.interval * u;
  vec3 p = b;
#ifdef HAS_TWO_STEPS
  p = PreviousPosition(i);
  way = (b - p) + way;
#endif
  return RelativeWay(surface, p, way);
}

// Whether a change of velocity [m/s] requires another sweep: it moves the particle by more than the tolerance.
// Smaller ones are applied too: in short substeps friction consists of nothing else.
bool IsAboveContactTolerance(float speed) {
#ifdef HAS_TOLERANCE
  precise float move = substep.interval * speed;
  return move > cloth.step.contact_tolerance;
#else
  return true;
#endif
}

Friction FrictionAtOnce() {
  Friction friction;
  friction.statics = cloth.step.friction_static;
  friction.dynamics = cloth.step.friction_dynamic;
#ifdef HAS_TWO_FRICTIONS
  friction.is_by_speed = false;
  friction.sliding_sq = 0.0;
  friction.slowest = cloth.step.slowest_landing / LANDING_SUBSTEPS;
#endif
  return friction;
}

#ifdef HAS_TWO_FRICTIONS
bool something_holds = false;  // a contact of the particle under way, by friction

uint SlidingWord(uint collider, uint i) { return cloth.scratch.slidings + collider * cloth.particle_count + i; }

// Of a contact that has a beta, if something of the cloth holds; the number at SlidingWord.
Friction FrictionBySpeed(float sliding_sq) {
  Friction friction = FrictionAtOnce();
  friction.sliding_sq = sliding_sq;
  friction.is_by_speed = sliding_sq >= 0.0;
  return friction;
}

// The friction of a contact in a sweep, of which `wanted`, of length `size`, would stop the sliding; how it slid when
// the substep began is kept. What holds marks the cloth: static friction holds what acts on it, apart from what it
// takes to stop it. Two frictions differ only with two steps (PlannedCloth::has_two_frictions).
Friction FrictionOf(uint c, uint i, Surface surface, vec3 normal_at_start, vec3 wanted, float size, float impulse) {
  vec3 v = RelativeAtStart(surface, PreviousPosition(i), PreviousVelocity(i));
  vec3 sliding = TangentialPart(v, normal_at_start);
  float sliding_sq = IsLanding(v, normal_at_start, cloth.step.slowest_landing) ? -1.0 : Dot(sliding, sliding);
  scratch[SlidingWord(c, i)] = sliding_sq;
  Friction friction = FrictionBySpeed(sliding_sq);
  precise float limit = friction.statics * impulse;
  precise vec3 acts = wanted + sliding;
  precise float rounding = SumOfSizes(PreviousPosition(i)) * (SLIP_ROUND_OFF * substep.inverse_interval);
  precise float sure = limit - min(rounding, SLIP_DOUBT * limit);
  precise float sure_sq = sure * sure;
  something_holds = something_holds || size <= limit || Dot(acts, acts) <= sure_sq;
  return friction;
}
#endif

#ifdef HAS_FRICTION
vec3 SolveContactFriction(uint c, uint i, Surface surface, vec3 normal_at_start, vec3 u, vec3 normal, float beta_n,
                          bool has_betas) {
  vec3 beta_t = has_betas ? LoadTangentBeta(c, i) : vec3(0.0);
  if (beta_n > 0.0 || beta_t != vec3(0.0)) {
    // With two steps u is the velocity at the end of the substep, else the mean over it.
    vec3 sliding = IsTwoStep() ? RelativeAtEnd(surface, AddScaled(Position(i), substep.interval, u), u)
                               : RelativeMean(surface, Position(i), u);
    float impulse = beta_n;
    if (IsTwoStep()) impulse = WholeImpulse(beta_n, Rebound(c, i), Dot(sliding, normal));
    precise vec3 wanted = beta_t - TangentialPart(sliding, normal);
    float size = Length(wanted);
#ifdef HAS_TWO_FRICTIONS
    Friction friction = FrictionOf(c, i, surface, normal_at_start, wanted, size, impulse);
#else
    Friction friction = FrictionAtOnce();
#endif
    vec3 given = TangentBeta(wanted, size, impulse, CoefficientOf(friction, size, impulse));
    precise vec3 change = given - beta_t;
    if (IsAboveContactTolerance(Length(change))) MarkChanged();
    u = AddScaled(u, 1.0, change);
    beta_t = given;
  }
  StoreTangentBeta(c, i, beta_t);
  return u;
}
#endif

// The mean velocity u of the particle after its contact with collider c, which is added to `met` if it pushes: only then
// its betas are stored.
vec3 SolveContact(uint c, uint i, vec3 p, vec3 u, bool is_first_sweep, inout uint met) {
  bool has_betas = HasMet(met, c, is_first_sweep);  // else they are 0
  Surface surface = LoadSurface(c);
  float beta_n = has_betas ? scratch[NormalBetaWord(c, i)] : 0.0;
  Gap at_start = GapAtStart(surface, StartPosition(i, p));
  float gap_floor = ContactFloor(at_start.size, cloth.step.max_depenetration);
  vec3 q = AddScaled(p, substep.interval, u);
  Gap gap = GapAtEnd(surface, q);
  float error = ContactError(gap.size, Dot(WayOf(surface, i, p, u), gap.normal), RoundOffOf(surface, q), gap_floor);
  float wanted = NormalBeta(beta_n, error, substep.inverse_interval);
  precise float change = wanted - beta_n;
  if (change != 0.0) {
    if (IsAboveContactTolerance(abs(change))) MarkChanged();
    u = AddScaled(u, change, gap.normal);
    beta_n = wanted;
  }
  if (!has_betas && beta_n == 0.0 && SetOf(c) != 0u) return u;
  met |= SetOf(c);
  scratch[NormalBetaWord(c, i)] = beta_n;
#ifdef HAS_FRICTION
  u = SolveContactFriction(c, i, surface, at_start.normal, u, gap.normal, beta_n, has_betas);
#endif
  return u;
}

#ifdef HAS_IMPULSES
// Where the collider's pivot is when the substep ends [m].
vec3 PivotAtEnd(uint c) {
#ifdef HAS_MOVING_COLLIDERS
  RigidMotion motion = LoadMotion(c);
  return AddScaled(motion.position, substep_end, motion.velocity);
#else
  return ParameterVector(ImpulseWord(DRAPE_IMPULSE_PIVOTS) + 3u * c);
#endif
}

// Collider c has changed the velocity of a particle from `before` to `after` [m/s].
void Push(uint c, uint i, vec3 place, vec3 before, vec3 after) {
  precise vec3 change = after - before;
  PushBy(c, PivotAtEnd(c), i, place, impulse_weight, change);
}
#endif

void SolveContactsOf(uint i, bool is_first_sweep) {
  if (InverseMass(i) == 0.0) return;
  vec3 p = Position(i);
  vec3 u = Velocity(i);
  vec3 q = AddScaled(p, substep.interval, u);
  uint met = LoadMetColliders(i, is_first_sweep);
  for (uint c = NextCollider(0u, met, q); c < cloth.collider_count;
       c = NextCollider(c + 1u, met, q)) {
#ifdef HAS_IMPULSES
    vec3 before = u;
#endif
    u = SolveContact(c, i, p, u, is_first_sweep, met);
#ifdef HAS_IMPULSES
    Push(c, i, q, before, u);
#endif
    q = AddScaled(p, substep.interval, u);
  }
  StoreMetColliders(i, met);
  SetVelocity(i, u);
#ifdef HAS_TWO_FRICTIONS
  if (something_holds) SetHoldsUntil(substep_end_index);
  something_holds = false;
#endif
}

#ifdef HAS_SOLVE_CONTACTS
// Depth of the end of the substep, p + h u, below the floor of its contacts [m]; for `measure`.
void StoreContactViolation(uint i) {
  float violation = 0.0;
  if (InverseMass(i) != 0.0) {
    vec3 p = Position(i);
    vec3 q = AddScaled(p, substep.interval, Velocity(i));
    for (uint c = NextCollider(0u, 0u, q); c < cloth.collider_count;
         c = NextCollider(c + 1u, 0u, q)) {
      Surface surface = LoadSurface(c);
      float gap_floor = ContactFloor(GapAtStart(surface, StartPosition(i, p)).size, cloth.step.max_depenetration);
      precise float below = gap_floor - GapAtEnd(surface, q).size;
      violation = max(violation, below);
    }
  }
  scratch[cloth.scratch.violations + i] = violation;
}
#endif

#if defined(HAS_SOLVE_CONTACTS) && defined(HAS_TWO_STEPS)
// Whether the particle hit collider c, which pushed it, in this substep, which began with the previous state.
bool HasLanded(uint c, uint i, Surface surface) {
#ifdef HAS_TWO_FRICTIONS
  return scratch[SlidingWord(c, i)] < 0.0;
#else
  vec3 p = PreviousPosition(i);
  vec3 v = RelativeAtStart(surface, p, PreviousVelocity(i));
  return IsLanding(v, GapAtStart(surface, p).normal, cloth.step.slowest_landing);
#endif
}

// A difference over two steps remembers the velocity before an impact: the particle goes on as if it had always
// flown with the velocity that the impact left.
void ForgetFlight(uint i, vec3 p, vec3 v) {
  precise vec3 kick = cloth.step.h * cloth.step.gravity.xyz;
  precise vec3 mean = v - 0.5 * kick;
  precise vec3 before = v - kick;
  SetPrevious(i, AddScaled(p, -cloth.step.h, mean), before);
}
#endif

#ifdef HAS_SOLVE_CONTACTS
// Corrects a velocity relative to the surface.
vec3 CorrectContactVelocity(uint c, uint i, Friction friction, vec3 normal, vec3 v) {
  float rebound = Rebound(c, i);
  vec3 beta_t = vec3(0.0);
#ifdef HAS_FRICTION
  beta_t = LoadTangentBeta(c, i);
#endif
  precise vec3 kick = 0.5 * substep.interval * cloth.step.gravity.xyz;
  return VelocityAfterContact(v, normal, kick, beta_t, scratch[NormalBetaWord(c, i)], rebound, IsTwoStep(), friction);
}

// The velocity v at p, the end of the substep, after all contacts that pushed.
vec3 VelocityAfterContacts(uint i, vec3 p, vec3 v) {
  bool has_landed = false;
#ifdef HAS_IMPULSES
  uint landed_on = 0u;  // the first one
#endif
  uint met = LoadMetColliders(i, false);
  for (uint c = NextMetCollider(0u, met); c < cloth.collider_count; c = NextMetCollider(c + 1u, met)) {
    if (scratch[NormalBetaWord(c, i)] <= 0.0) continue;
    Surface surface = LoadSurface(c);
    vec3 normal = GapAtEnd(surface, p).normal;
    Friction friction = FrictionAtOnce();
#ifdef HAS_TWO_FRICTIONS
    if (HoldsUntil() == substep_end_index) friction = FrictionBySpeed(scratch[SlidingWord(c, i)]);
#endif
    vec3 relative = CorrectContactVelocity(c, i, friction, normal, RelativeAtEnd(surface, p, v));
#ifdef HAS_IMPULSES
    vec3 before = v;
#endif
    v = AbsoluteAtEnd(surface, p, relative);
#ifdef HAS_IMPULSES
    Push(c, i, p, before, v);
    if (!has_landed) landed_on = c;
#endif
#ifdef HAS_TWO_STEPS
    if (!has_landed) has_landed = HasLanded(c, i, surface);
#endif
  }
#ifdef HAS_TWO_STEPS
#ifdef HAS_IMPULSES
  vec3 remembered = PreviousVelocity(i);
#endif
  if (has_landed) ForgetFlight(i, p, v);
#ifdef HAS_IMPULSES
  precise vec3 forgotten = remembered - PreviousVelocity(i);
  if (has_landed) PushBy(landed_on, PivotAtEnd(landed_on), i, p, memory_weight, forgotten);
#endif
#endif
  return v;
}
#endif

// Contacts: no approach velocity, Coulomb friction; then damping, which with two steps is in `predict`. Free
// particles only.
void CorrectVelocity(uint i) {
#if defined(HAS_SOLVE_CONTACTS) || defined(HAS_DAMPING)
  if (InverseMass(i) == 0.0) return;
  vec3 v = Velocity(i);
#ifdef HAS_SOLVE_CONTACTS
  v = VelocityAfterContacts(i, Position(i), v);
#endif
#ifdef HAS_DAMPING
  precise vec3 damped = v * substep.damping_factor;
  if (!IsTwoStep()) v = damped;
#endif
  SetVelocity(i, v);
#endif
}
