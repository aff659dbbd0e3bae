// Stage `solve_strips` by elimination and cyclic reduction (server/solver/method.md, "solve_strips") of cloths of many
// particles (LANE_QUADS): each lane has four neighbouring particles of a strip and the links that end there. Three of
// these it eliminates by itself, link after link; the fourth ones, which are kept, are solved at once. A group of lanes
// has whole strips, as many as fit. So a phase needs no barrier. Resident plan only. Needs strip_lanes.glsl;
// solve_lanes.glsl calls it.

// What a lane takes of a phase.
struct LaneSlotWords {
  uvec2 word;         // of the table of lanes (DRAPE_STRIP_LANE_WORDS, quads); 0: nothing
  float rest_length;  // of each link [m]
#ifndef HAS_REGULAR_STRIPS
  vec3 later_lengths;  // rest_length is that of the first link
#endif
#ifdef KEEPS_LANES
  uint pins;  // PackPins
#endif
};

LaneSlotWords NoLane() {
  LaneSlotWords words;
  words.word = uvec2(0u);
  words.rest_length = 1.0;
#ifndef HAS_REGULAR_STRIPS
  words.later_lengths = vec3(1.0);
#endif
  return words;
}

bool HasWork(LaneSlotWords words) { return words.word.y != 0u; }

struct LaneOfStrip {
  uvec4 particles;  // where a strip begins within a lane, its first one several times
  int k;            // of the first particle in its strip, at least -3; -4: this lane has nothing to do
  uint first_link;  // of the strip: its place in the lists of links
};

LaneOfStrip UnpackLane(uvec2 word) {
  uvec4 particles = uvec4(word.x & 0x3ffu, word.x >> 10 & 0x3ffu, word.x >> 20, word.y & 0x3ffu);
  return LaneOfStrip(particles, int(word.y >> 10 & 63u) - 4, word.y >> 19);
}

// A bit per lane of the strip.
uint LanesOfStrip(uvec2 word) {
  uint lane_of_strip = max(word.y >> 10 & 63u, 1u) - 1u >> 2;
  return ((2u << (word.y >> 16 & 7u)) - 1u) << (Lane() - lane_of_strip);
}

// The next lane of the group; of the last one the first one, where a strip begins.
uint NextLane() { return Lane() + 1u & DRAPE_STRIP_LANES - 1u; }

bool IsLane(LaneOfStrip mine) { return mine.k >= -3; }
// Whether there is a particle of this number of the lane, a link that ends there, and one that begins before that.
bool HasParticle(LaneOfStrip mine, int number) { return mine.k + number >= 0; }
bool HasLink(LaneOfStrip mine, int number) { return mine.k + number >= 1; }
bool HasLinkBefore(LaneOfStrip mine, int number) { return mine.k + number >= 2; }
// The place of that link in the lists of links.
uint PlaceOfLink(LaneOfStrip mine, int number) { return mine.first_link + uint(mine.k + number) - 1u; }

#ifdef HAS_REGULAR_STRIPS
vec4 LengthsOf(LaneSlotWords words) { return vec4(words.rest_length); }
#else
vec4 LengthsOf(LaneSlotWords words) { return vec4(words.rest_length, words.later_lengths); }
// Of the link that ends at the particle, or of the first one of the strip [m].
float LengthBefore(LaneOfStrip mine, int number) {
  return ModelFloat(cloth.model.strip_lengths + mine.first_link + uint(max(mine.k + number, 1)) - 1u);
}
#endif

LaneSlotWords LoadLaneSlot(uint slot) {
  uint begin = cloth.model.strip_lanes + DRAPE_STRIP_LANE_WORDS * slot;
  LaneSlotWords words = NoLane();
  words.word = uvec2(models[begin], models[begin + 1u]);
  LaneOfStrip mine = UnpackLane(words.word);
#ifdef HAS_REGULAR_STRIPS
  words.rest_length = ModelFloat(cloth.model.strip_lengths + mine.first_link);
#else
  words.rest_length = LengthBefore(mine, 0);
  words.later_lengths = vec3(LengthBefore(mine, 1), LengthBefore(mine, 2), LengthBefore(mine, 3));
#endif
  return words;
}

// A link that ends at a pin is eliminated from no other (ReduceRows in meet_strips.glsl). One that is not kept stays
// beside the kept one of its lane then: the inner link.
struct PinsOfStrip {
  int inner;             // the number of the first link that ends at a pin and is not kept; 3: none
  bool is_before_first;  // the next lane's inner link is its first one
  bool has_inner;        // any lane has an inner link
  uint next;             // the lane of the first link that ends at a pin, from the kept one of this lane on;
                         // DRAPE_STRIP_LANES: none
};

const PinsOfStrip kNoPins = PinsOfStrip(3, false, false, DRAPE_STRIP_LANES);

bool EndsAtPin(LaneOfStrip mine, int number, float inverse_mass) {
  return HasLink(mine, number) && inverse_mass == 0.0;
}

// `lanes`: of the strip, `inverse_masses`: of the particles [1/kg].
PinsOfStrip FindPins(LaneOfStrip mine, uint lanes, vec4 inverse_masses) {
  PinsOfStrip pins = kNoPins;
#ifdef HAS_PINS
  if (EndsAtPin(mine, 2, inverse_masses.z)) pins.inner = 2;
  if (EndsAtPin(mine, 1, inverse_masses.y)) pins.inner = 1;
  if (EndsAtPin(mine, 0, inverse_masses.x)) pins.inner = 0;
  bool kept_ends_at_pin = EndsAtPin(mine, 3, inverse_masses.w);
  uint ending = (LanesWith(kept_ends_at_pin || pins.inner < 3) & lanes) >> Lane();
  if (!kept_ends_at_pin) ending &= ~1u;
  if (ending != 0u) pins.next = Lane() + uint(findLSB(ending));
  pins.is_before_first = ((LanesWith(pins.inner == 0) & lanes) >> 1 >> Lane() & 1u) != 0u;
  pins.has_inner = HasAnyLane(pins.inner < 3);
#endif
  return pins;
}

#ifdef KEEPS_LANES
uint PackPins(PinsOfStrip pins) { return pins.next | uint(pins.inner) << 6 | uint(pins.is_before_first) << 8; }
PinsOfStrip UnpackPins(uint word) {
#ifdef HAS_PINS
  int inner = int(word >> 6 & 3u);
  // Not kept: compilers must see that it is the same in all lanes.
  bool has_inner = HasAnyLane(inner < 3);
  return PinsOfStrip(inner, (word & 256u) != 0u, has_inner, word & 63u);
#else
  return kNoPins;
#endif
}
#endif

// Of the links of a lane.
struct LaneLinks {
  LinearisedLink first;
  LinearisedLink second;
  LinearisedLink third;
  LinearisedLink kept;
};

LinearisedLink LinkOf(LaneOfStrip mine, int number, float rest_length, LinkEnd from, LinkEnd to, bool is_first_sweep) {
#ifdef HAS_COMPLIANCE
  if (!HasLink(mine, number)) return NoLink(rest_length);
#endif
  LinearisedLink link = LineariseLink(PlaceOfLink(mine, number), rest_length, from, to, is_first_sweep);
  if (!HasLink(mine, number)) {
    link.error.residual = 0.0;
    link.diagonal = 1.0;
  }
  return link;
}

// The rows of the links of a lane.
struct LaneRows {
  StripRow first;
  StripRow second;
  StripRow third;
  StripRow kept;
};

StripRow RowOf(LinearisedLink link, float from_before, float from_after) {
  return UndividedRow(link.diagonal, from_before, from_after,
                      StripRightSide(link.error.residual, substep.inverse_link_interval));
}

// The effect of a link's impulse on the next one's error, which is the one of the lane with this number [1/kg].
float EffectOn(LaneOfStrip mine, int number, vec3 direction, LinearisedLink next, float inverse_mass) {
  float effect = StripCoupling(direction, next.error.direction, inverse_mass);
  return HasLinkBefore(mine, number) ? effect : 0.0;
}

#ifdef HAS_START_DIRECTIONS
float EffectOnBefore(LaneOfStrip mine, int number, LinearisedLink before, vec3 direction, float inverse_mass) {
  float effect = StripCoupling(direction, before.error.direction, inverse_mass);
  return HasLinkBefore(mine, number) ? effect : 0.0;
}
#endif

// `inverse_masses`: of the particles of the lane, `mass_before`: of that before [1/kg].
LaneRows RowsOf(LaneOfStrip mine, LaneLinks links, float mass_before, vec4 inverse_masses) {
  Offer(vec4(links.kept.direction, 0.0));
  float on_first = EffectOn(mine, 0, OfferOf(LaneBefore(1u)).xyz, links.first, mass_before);
  float on_second = EffectOn(mine, 1, links.first.direction, links.second, inverse_masses.x);
  float on_third = EffectOn(mine, 2, links.second.direction, links.third, inverse_masses.y);
  float on_kept = EffectOn(mine, 3, links.third.direction, links.kept, inverse_masses.z);
#ifdef HAS_START_DIRECTIONS
  float of_second = EffectOnBefore(mine, 1, links.first, links.second.direction, inverse_masses.x);
  float of_third = EffectOnBefore(mine, 2, links.second, links.third.direction, inverse_masses.y);
  float of_kept = EffectOnBefore(mine, 3, links.third, links.kept.direction, inverse_masses.z);
  // 0 where there is no next one.
  Offer(vec4(HasLinkBefore(mine, 0) ? links.first.direction : vec3(0.0), 0.0));
  float of_next = StripCoupling(OfferOf(NextLane()).xyz, links.kept.error.direction, inverse_masses.w);
#else
  // Two links have the same effect on each other.
  float of_second = on_second;
  float of_third = on_third;
  float of_kept = on_kept;
  Offer(vec4(on_first));
  float of_next = OfferOf(NextLane()).x;
#endif
  return LaneRows(RowOf(links.first, on_first, of_second), RowOf(links.second, on_second, of_third),
                  RowOf(links.third, on_third, of_kept), RowOf(links.kept, on_kept, of_next));
}

// The least pivot over the diagonal of a link that is not kept.
float LeastPivot(LinearisedLink link, float inverse_mass) {
  // A pivot depends on particles on both sides, so its bound is lower than that of an elimination.
  precise float least = MIN_STRIP_PIVOT / float(1u << cloth.strip_all_levels);
#ifdef HAS_PINS
  if (inverse_mass == 0.0) least = MIN_STRIP_PIVOT_AT_PIN;
#endif
  precise float least_pivot = least * link.diagonal;
  return least_pivot;
}

// A row that is left after the lanes have eliminated the others.
struct KeptRow {
  StripRow row;
  float least;  // pivot
};

KeptRow Kept(ReducedRow reduced, float least) {
  precise float left = least * reduced.inverse_pivot;
  return KeptRow(reduced.row, left);
}

// What is left of the rows of a lane.
struct KeptRows {
  KeptRow kept;
  KeptRow inner;  // only with pins.has_inner
};

// The rows of the links of a lane that are not kept, each after elimination of the one before.
struct EliminatedRows {
  ReducedRow first;
  ReducedRow second;
  ReducedRow third;
};

KeptRow InnerRow(LaneLinks links, vec4 inverse_masses, PinsOfStrip pins, EliminatedRows rows) {
  if (pins.inner == 0) return Kept(rows.first, LeastPivot(links.first, inverse_masses.x));
  if (pins.inner == 1) return Kept(rows.second, LeastPivot(links.second, inverse_masses.y));
  if (pins.inner == 2) return Kept(rows.third, LeastPivot(links.third, inverse_masses.z));
  return KeptRow(StripRow(0.0, 0.0, 0.0, 1.0), 1.0);
}

KeptRow ReduceInner(KeptRow inner, StripRow before) {
  return Kept(ReduceBefore(inner.row, before, inner.least), inner.least);
}

// Eliminates from each row but the kept one that before it, then from all of them those after it up to the inner or
// kept one, then from the kept one its neighbours.
KeptRows KeepRows(LaneLinks links, vec4 inverse_masses, PinsOfStrip pins, inout LaneRows rows) {
  EliminatedRows eliminated;
  eliminated.first = DivideRow(rows.first, links.first.diagonal);
  eliminated.second = ReduceBefore(rows.second, eliminated.first.row, LeastPivot(links.second, inverse_masses.y));
  eliminated.third = ReduceBefore(rows.third, eliminated.second.row, LeastPivot(links.third, inverse_masses.z));
  KeptRow inner = KeptRow(eliminated.third.row, 0.0);
  if (pins.has_inner) inner = InnerRow(links, inverse_masses, pins, eliminated);
  rows = LaneRows(eliminated.first.row, eliminated.second.row, eliminated.third.row, rows.kept);
  if (pins.inner != 2) rows.second = ReduceAfter(rows.second, rows.third);
  if (pins.inner != 1) rows.first = ReduceAfter(rows.first, rows.second);
  Offer(PackRow(rows.first));
  float least = LeastPivot(links.kept, inverse_masses.w);
  ReducedRow reduced = ReduceRow(rows.kept, rows.third, UnpackRow(OfferOf(NextLane())), !pins.is_before_first, least);
  return KeptRows(Kept(reduced, least), inner);
}

// Impulses [N s].
struct KeptImpulses {
  float kept;
  float inner;
};

// That of the pin which a lane has.
float ImpulseAtPin(KeptImpulses impulses, PinsOfStrip pins) { return pins.inner < 3 ? impulses.inner : impulses.kept; }

KeptImpulses ReduceKept(KeptRows left, PinsOfStrip pins) {
  KeptRow kept = left.kept;
  KeptRow inner = left.inner;
  // A constant number of rounds, for compilers to unroll.
  for (uint level = 0u; level < DRAPE_STRIP_QUAD_LEVELS; ++level) {
    if (level + 2u < cloth.strip_all_levels) {
      uint stride = 1u << level;
      Offer(PackRow(kept.row));
      // Rows that have none before or after have 0 times that of another lane.
      StripRow before = UnpackRow(OfferOf(LaneBefore(stride)));
      StripRow after = UnpackRow(OfferOf(LaneAfter(stride)));
      kept = Kept(ReduceRow(kept.row, before, after, Lane() + stride < pins.next, kept.least), kept.least);
      if (pins.has_inner) inner = ReduceInner(inner, before);
    }
  }
  KeptImpulses impulses = KeptImpulses(kept.row.right_side, inner.row.right_side);
#ifdef HAS_PINS
  float at_pin = impulses.kept;
  if (pins.has_inner) at_pin = ImpulseAtPin(impulses, pins);
  Offer(vec4(at_pin));
  at_pin = OfferOf(min(pins.next, DRAPE_STRIP_LANES - 1u)).x;
  precise float impulse = kept.row.right_side - kept.row.after * at_pin;
  if (pins.next < DRAPE_STRIP_LANES && pins.next != Lane()) impulses.kept = impulse;
#endif
  return impulses;
}

float ImpulseOf(StripRow row, float before, float after) {
  precise float impulse = row.right_side - row.before * before - row.after * after;
  return impulse;
}

// `impulses`: of the links of the lane, as if it had no inner link [N s].
vec4 WithInner(vec4 impulses, LaneRows rows, float before, float of_inner, int inner) {
  if (inner >= 1 && inner < 3) impulses.x = ImpulseOf(rows.first, before, of_inner);
  if (inner == 2) impulses.y = ImpulseOf(rows.second, before, of_inner);
  if (inner == 0) impulses.x = of_inner;
  if (inner == 1) impulses.y = of_inner;
  if (inner == 2) impulses.z = of_inner;
  return impulses;
}

// The impulses of the links of the lane [N s].
vec4 SolveLinks(LaneLinks links, vec4 inverse_masses, PinsOfStrip pins, LaneRows rows) {
  KeptRows left = KeepRows(links, inverse_masses, pins, rows);
  KeptImpulses found = ReduceKept(left, pins);
  Offer(vec4(found.kept));
  float before = OfferOf(LaneBefore(1u)).x;
  vec4 impulses = vec4(ImpulseOf(rows.first, before, found.kept), ImpulseOf(rows.second, before, found.kept),
                       ImpulseOf(rows.third, before, found.kept), found.kept);
  if (pins.has_inner) impulses = WithInner(impulses, rows, before, found.inner, pins.inner);
  return impulses;
}

// The changes of velocity of the particles [m/s].
struct LaneChanges {
  vec3 first;
  vec3 second;
  vec3 third;
  vec3 fourth;
};

// The share of the impulses of a strip that moves no particle too far. `lengths`: of the link before each particle, or
// of the first one [m].
float LargestShare(uint lanes, LaneChanges changes, vec4 lengths) {
  float of_first = max(MoveRatioSq(changes.first, lengths.x), MoveRatioSq(changes.second, lengths.y));
  float of_later = max(MoveRatioSq(changes.third, lengths.z), MoveRatioSq(changes.fourth, lengths.w));
  return ShareOfMove(TakeLargest(lanes, max(of_first, of_later)));
}

// 1 mostly.
float TakeShare(uvec2 word, LaneChanges changes, vec4 lengths) {
  bool is_far = MovesFar(changes.first, lengths.x) || MovesFar(changes.second, lengths.y) ||
                MovesFar(changes.third, lengths.z) || MovesFar(changes.fourth, lengths.w);
  return HasAnyLane(is_far) ? LargestShare(LanesOfStrip(word), changes, lengths) : 1.0;
}

void ApplyToLink(LaneOfStrip mine, int number, LinearisedLink link, float share, float impulse) {
  if (!HasLink(mine, number)) return;
  precise float applied = share * impulse;
  uint place = PlaceOfLink(mine, number);
  AccumulateImpulse(place, applied);
#ifdef HAS_IMPULSES
  precise vec3 pull = applied * link.direction;
  uvec2 ends = StripEnds(place);
  PullAtStripLink(place, ends.x, ends.y, pull);
#endif
}

void ApplyToParticle(uint particle, float inverse_mass, float share, vec3 change) {
  if (inverse_mass != 0.0) SetVelocity(particle, AddScaled(Velocity(particle), share, change));
}

LinkEnd LoadLaneEnd(LaneOfStrip mine, int number, uint particle) {
  LinkEnd end = LoadEnd(particle);
  if (!HasParticle(mine, number)) end.inverse_mass = 0.0;
  return end;
}

bool HasError(LaneLinks links) {
  return IsBeyondTolerance(links.first) || IsBeyondTolerance(links.second) || IsBeyondTolerance(links.third) ||
         IsBeyondTolerance(links.kept);
}

void SolveLane(LaneSlotWords words, bool is_first_sweep) {
  LaneOfStrip mine = UnpackLane(words.word);
  vec4 lengths = LengthsOf(words);
  LinkEnd a = LinkEnd(vec3(0.0), vec3(0.0), 0.0, 0.0);
  LinkEnd b = a;
  LinkEnd c = a;
  LinkEnd d = a;
  if (IsLane(mine)) {
    a = LoadLaneEnd(mine, 0, mine.particles.x);
    b = LoadLaneEnd(mine, 1, mine.particles.y);
    c = LoadLaneEnd(mine, 2, mine.particles.z);
    d = LoadLaneEnd(mine, 3, mine.particles.w);
  }
  LinkEnd before = TakeEnd(d, LaneBefore(1u));
  LaneLinks links;
  links.first = LinkOf(mine, 0, lengths.x, before, a, is_first_sweep);
  links.second = LinkOf(mine, 1, lengths.y, a, b, is_first_sweep);
  links.third = LinkOf(mine, 2, lengths.z, b, c, is_first_sweep);
  links.kept = LinkOf(mine, 3, lengths.w, c, d, is_first_sweep);
  vec4 inverse_masses = vec4(a.inverse_mass, b.inverse_mass, c.inverse_mass, d.inverse_mass);
#ifdef KEEPS_LANES
  PinsOfStrip pins = UnpackPins(words.pins);
#else
  PinsOfStrip pins = FindPins(mine, LanesOfStrip(words.word), inverse_masses);
#endif
  LaneRows rows = RowsOf(mine, links, before.inverse_mass, inverse_masses);
  vec4 impulses = SolveLinks(links, inverse_masses, pins, rows);

  precise vec3 pull_of_first = impulses.x * links.first.direction;
  precise vec3 pull_of_second = impulses.y * links.second.direction;
  precise vec3 pull_of_third = impulses.z * links.third.direction;
  precise vec3 pull_of_kept = impulses.w * links.kept.direction;
  Offer(vec4(pull_of_first, 0.0));
  vec3 pull_of_next = OfferOf(NextLane()).xyz;
  precise vec3 change_of_a = a.inverse_mass * (pull_of_first - pull_of_second);
  precise vec3 change_of_b = b.inverse_mass * (pull_of_second - pull_of_third);
  precise vec3 change_of_c = c.inverse_mass * (pull_of_third - pull_of_kept);
  precise vec3 change_of_d = d.inverse_mass * (pull_of_kept - pull_of_next);
  float share = TakeShare(words.word, LaneChanges(change_of_a, change_of_b, change_of_c, change_of_d), lengths);
  if (!IsActive(LanesOfStrip(words.word), HasError(links)) || !IsLane(mine)) return;
  MarkChanged();
  ApplyToLink(mine, 0, links.first, share, impulses.x);
  ApplyToLink(mine, 1, links.second, share, impulses.y);
  ApplyToLink(mine, 2, links.third, share, impulses.z);
  ApplyToLink(mine, 3, links.kept, share, impulses.w);
  ApplyToParticle(mine.particles.x, a.inverse_mass, share, change_of_a);
  ApplyToParticle(mine.particles.y, b.inverse_mass, share, change_of_b);
  ApplyToParticle(mine.particles.z, c.inverse_mass, share, change_of_c);
  ApplyToParticle(mine.particles.w, d.inverse_mass, share, change_of_d);
}

#ifdef KEEPS_LANES
// With the pins, which do not change within a step. Once the masses are known.
LaneSlotWords WithPins(LaneSlotWords words) {
  LaneOfStrip mine = UnpackLane(words.word);
  vec4 inverse_masses = vec4(InverseMass(mine.particles.x), InverseMass(mine.particles.y),
                             InverseMass(mine.particles.z), InverseMass(mine.particles.w));
  words.pins = PackPins(FindPins(mine, LanesOfStrip(words.word), inverse_masses));
  return words;
}
#endif
