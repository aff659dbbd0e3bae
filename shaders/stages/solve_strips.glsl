// Stage `solve_strips`. Needs the accessors of one plan.
#include "lib/direction.glsl"
#include "lib/strip.glsl"
#include "stages/quiet_links.glsl"
#include "stages/substep.glsl"

// Scratch of link k: n xyz, the effect of its impulse on the previous error over the pivot there, right side over
// the pivot [N s].
uint LinkWord(uint k) { return cloth.scratch.strip_links + DRAPE_STRIP_LINK_WORDS * k; }

// The places of the links and particles of a strip.
struct Strip {
  uint first_link;
  uint link_count;
#ifdef HAS_REGULAR_STRIPS
  uint first;         // particle
  uint stride;        // from one particle to the next
  float rest_length;  // of each link [m]
#else
  uint particles;  // the place of the first one in Models
#endif
};

Strip LoadStrip(uint strip) {
#ifdef HAS_REGULAR_STRIPS
  uint word = cloth.model.regular_strips + DRAPE_REGULAR_STRIP_WORDS * strip;
  uint begin = models[word];
  return Strip(begin, models[word + 1u] - begin, models[word + 2u], models[word + 3u], ModelFloat(word + 4u));
#else
  uint word = cloth.model.strip_offsets + strip;
  uint begin = models[word];
  return Strip(begin, models[word + 1u] - begin, cloth.model.strip_particles + strip + begin);
#endif
}

// The place of its k-th link in the lists of links.
uint StripLinkAt(Strip strip, uint k) { return strip.first_link + k; }

// The particle before its k-th link, or after the last one.
uint StripParticle(Strip strip, uint k) {
#ifdef HAS_REGULAR_STRIPS
  return strip.first + strip.stride * k;
#else
  return models[strip.particles + k];
#endif
}

float StripRestLength(Strip strip, uint k) {
#ifdef HAS_REGULAR_STRIPS
  return strip.rest_length;
#else
  return ModelFloat(cloth.model.strip_lengths + StripLinkAt(strip, k));
#endif
}

// A particle at an end of a link.
struct LinkEnd {
  vec3 position;
  vec3 velocity;
  float inverse_mass;
  float quiet_round_off;  // [m]
};

LinkEnd LoadEnd(uint i) {
  LinkEnd end = LinkEnd(Position(i), Velocity(i), InverseMass(i), 0.0);
#ifdef HAS_QUIET_LINKS
  end.quiet_round_off = QuietRoundOff(i, end.position);
#endif
  return end;
}

// A link at the predicted positions.
struct LinearisedLink {
  float rest_length;  // [m]
  DistanceError error;
  vec3 direction;  // n, of the impulse
  float diagonal;  // effect of the impulse on the error: (w_from + w_to) slope (1 + give) + alpha/h^2 [1/kg]
};

// `place`: of the link in the lists of links.
LinearisedLink LineariseLink(uint place, float rest_length, LinkEnd from, LinkEnd to, bool is_first_sweep) {
  LinearisedLink link;
  link.rest_length = rest_length;
  float compliance = 0.0;
  float lambda = 0.0;
#ifdef HAS_COMPLIANCE
  uint constraint = models[cloth.model.strip_constraints + place];
  compliance = ModelFloat(cloth.model.compliances + constraint);
  if (is_first_sweep) {
    scratch[cloth.scratch.lambdas + constraint] = 0.0;
  } else {
    lambda = scratch[cloth.scratch.lambdas + constraint];
  }
#endif
  precise vec3 position_difference = to.position - from.position;
  precise vec3 velocity_difference = to.velocity - from.velocity;
  link.error = PredictDistanceError(position_difference, velocity_difference, substep.link_interval,
                                    InverseForceTime(), link.rest_length, compliance, lambda);
#ifdef HAS_QUIET_LINKS
  precise float round_off = from.quiet_round_off + to.quiet_round_off;
  if (round_off > 0.0) {
    link.error.residual =
        QuietError(position_difference, velocity_difference, substep.link_interval, link.rest_length, round_off);
#ifdef HAS_COMPLIANCE
    link.error.residual = SoftenedResidual(link.error.residual, compliance, InverseForceTime(), lambda);
#endif
  }
#endif
  precise float diagonal = from.inverse_mass + to.inverse_mass;
#ifdef HAS_GRIPS
  // Nothing moves a link between two grips: it has no error.
  if (diagonal == 0.0) {
    link.error.residual = 0.0;
    diagonal = 1.0;
  }
#endif
  link.direction = link.error.direction;
#ifdef HAS_START_DIRECTIONS
  ImpulseLine line = BlendDirections(position_difference, link.error.direction, cloth.step.end_share);
  link.direction = line.direction;
  diagonal = diagonal * line.slope;
#endif
#ifdef HAS_SPANS_THAT_GIVE
  diagonal = diagonal * (1.0 + cloth.span_give * ModelFloat(cloth.model.strip_spans + place));
#endif
#ifdef HAS_COMPLIANCE
  diagonal = diagonal + compliance * InverseForceTime() * substep.inverse_link_interval;
#endif
  link.diagonal = diagonal;
  return link;
}

bool IsBeyondTolerance(LinearisedLink link) {
  return abs(link.error.residual) > cloth.step.tolerance * link.rest_length;
}

// The least share of the diagonal for the pivot of a link whose second particle has this inverse mass.
float MinPivot(float inverse_mass) {
  return inverse_mass == 0.0 ? MIN_STRIP_PIVOT_AT_PIN : MIN_STRIP_PIVOT;
}

// A strip after elimination.
struct EliminatedStrip {
  bool is_active;  // whether an error is larger than the tolerance
  float last_impulse;  // [N s]
};

// Linearises each link of the strip in turn and eliminates it from the next.
EliminatedStrip EliminateStrip(Strip strip, bool is_first_sweep) {
  bool is_active = false;
  StripLink before = StripLink(vec3(0.0), vec3(0.0), 0.0, 0.0);
  LinkEnd from = LoadEnd(StripParticle(strip, 0u));
  for (uint k = 0u; k < strip.link_count; ++k) {
    LinkEnd to = LoadEnd(StripParticle(strip, k + 1u));
    uint place = StripLinkAt(strip, k);
    LinearisedLink link = LineariseLink(place, StripRestLength(strip, k), from, to, is_first_sweep);
    if (IsBeyondTolerance(link)) is_active = true;
    float coupling = 0.0;
    precise float ratio = 0.0;
    if (k > 0u) {
      coupling = StripCoupling(before.direction, link.error.direction, from.inverse_mass);
#ifdef HAS_START_DIRECTIONS
      ratio = StripCoupling(link.direction, before.n_end, from.inverse_mass) * before.inverse_pivot;
#else
      ratio = coupling * before.inverse_pivot;
#endif
    }
    before = EliminateLink(link.error, link.direction, link.diagonal, MinPivot(to.inverse_mass),
                           substep.inverse_link_interval, coupling, ratio, before);
    uint word = LinkWord(place);
    SetScratchVector(word, before.direction);
    scratch[word + 3u] = ratio;
    scratch[word + 4u] = before.right_side;
    from = to;
  }
  return EliminatedStrip(is_active, before.right_side);
}

// The square of the ratio of a change of velocity [m/s] to the one that moves by MAX_STRIP_MOVE lengths [m] of a
// link.
float MoveLimitSq(float rest_length) {
  precise float limit = rest_length * (MAX_STRIP_MOVE * substep.inverse_link_interval);
  precise float limit_sq = limit * limit;
  return limit_sq;
}
float MoveRatioSq(vec3 change, float rest_length) { return Quotient(Dot(change, change), MoveLimitSq(rest_length)); }
// Whether that is above 1, without the quotient.
bool MovesFar(vec3 change, float rest_length) { return Dot(change, change) > MoveLimitSq(rest_length); }

// The share of the impulses that makes the largest move as large as it may be.
float ShareOfMove(float largest_ratio_sq) {
  if (!(largest_ratio_sq > 1.0)) return 1.0;
  return Quotient(1.0, Root(largest_ratio_sq));
}

// Changes the velocity of a particle, unless it is a pin, by the impulses of the links before and after
// it; MoveRatioSq of the change.
float PullParticle(uint i, vec3 pull, vec3 pull_of_next, float rest_length) {
  float inverse_mass = InverseMass(i);
  precise vec3 change = inverse_mass * (pull - pull_of_next);
  precise vec3 velocity = Velocity(i) + change;
  if (inverse_mass != 0.0) SetVelocity(i, velocity);
  return MoveRatioSq(change, rest_length);
}

// The accumulated impulse of a link, of the place in the lists of links, grows by `applied` [N s].
void AccumulateImpulse(uint place, float applied) {
#ifdef HAS_COMPLIANCE
  uint lambda = cloth.scratch.lambdas + models[cloth.model.strip_constraints + place];
  precise float accumulated = scratch[lambda] + applied;
  scratch[lambda] = accumulated;
#endif
}

#ifdef HAS_IMPULSES
// By a link, of the place in the lists of links, on the particle after it; the opposite on the one before it.
void PullAtStripLink(uint place, uint from, uint to, vec3 pull) {
  if (!PullsOnHeld(InverseMass(from), InverseMass(to))) return;
  uint constraint = models[cloth.model.strip_constraints + place];
  PullAtConstraint(constraint, ConstraintPair(constraint).y == to ? pull : -pull);
}
#endif

// Finds the impulses from the last link back and applies `share` of them. Returns the largest MoveRatioSq.
float ApplyImpulses(Strip strip, float share, float last_impulse) {
  float largest_ratio_sq = 0.0;
  vec3 pull_of_next = vec3(0.0);
  precise float effect_of_next = 0.0;  // on this impulse
  for (uint k = strip.link_count; k-- > 0u;) {
    uint word = LinkWord(StripLinkAt(strip, k));
    precise float impulse = k + 1u == strip.link_count ? last_impulse : scratch[word + 4u] - effect_of_next;
    effect_of_next = scratch[word + 3u] * impulse;
    precise float applied = share * impulse;
    AccumulateImpulse(StripLinkAt(strip, k), applied);
    precise vec3 pull = applied * ScratchVector(word);
#ifdef HAS_IMPULSES
    PullAtStripLink(StripLinkAt(strip, k), StripParticle(strip, k), StripParticle(strip, k + 1u), pull);
#endif
    float ratio_sq =
        PullParticle(StripParticle(strip, k + 1u), pull, pull_of_next, StripRestLength(strip, k));
    largest_ratio_sq = max(largest_ratio_sq, ratio_sq);
    pull_of_next = pull;
  }
  float ratio_sq = PullParticle(StripParticle(strip, 0u), vec3(0.0), pull_of_next,
                                StripRestLength(strip, 0u));
  return max(largest_ratio_sq, ratio_sq);
}

// All constraints of one strip together. The phases give each free particle one writer.
void SolveStrip(uint index, bool is_first_sweep) {
  Strip strip = LoadStrip(index);
  EliminatedStrip eliminated = EliminateStrip(strip, is_first_sweep);
  if (!eliminated.is_active) return;
  MarkChanged();
  // Applies all of the impulses, then removes the excess if they moved a particle too far, which is rare.
  precise float share = 1.0;
  do {
    precise float back = ShareOfMove(ApplyImpulses(strip, share, eliminated.last_impulse)) - 1.0;
    share = share == 1.0 ? back : 0.0;
  } while (share != 0.0);
}

// A strip without links.
Strip NoStrip() {
#ifdef HAS_REGULAR_STRIPS
  return Strip(0u, 0u, 0u, 0u, 0.0);
#else
  return Strip(0u, 0u, 0u);
#endif
}
