// Stage `solve_strips` by cyclic reduction (server/solver/method.md, "solve_strips") of cloths of many particles
// (LANE_PAIRS): each lane has two neighbouring particles of a strip and the links from them to the next ones. One of
// the two links it eliminates by itself; the others are solved at once. A group of lanes has whole strips, as many as
// fit. So a phase needs no barrier. Resident plan only. Needs strip_lanes.glsl; solve_lanes.glsl calls it.

// What a lane takes of a phase.
struct LaneSlotWords {
  uint word;           // of the table of lanes (DRAPE_STRIP_LANE_WORDS, pairs); 0: nothing
  uint place;          // of the first link in the lists of links; meaningless where there is none
  float rest_length;   // of the first link [m]
#ifndef HAS_REGULAR_STRIPS
  float second_length;  // of the second one [m]
#endif
#ifdef KEEPS_LANES
  uint pins;  // PackPins
#endif
};

LaneSlotWords NoLane() {
  LaneSlotWords words;
  words.word = words.place = 0u;
  words.rest_length = 1.0;
#ifndef HAS_REGULAR_STRIPS
  words.second_length = 1.0;
#endif
  return words;
}

float SecondLength(LaneSlotWords words) {
#ifdef HAS_REGULAR_STRIPS
  return words.rest_length;
#else
  return words.second_length;
#endif
}

struct LaneOfStrip {
  uint first;       // particle
  uint second;      // particle; the first one where there is none
  uint k;           // of the first particle in its strip
  uint link_count;  // of the strip; 0: this lane has nothing to do
  uint lanes;       // a bit per lane of the strip
};

LaneOfStrip UnpackLane(uint word) {
  uint lane_of_strip = word >> 20 & 31u;
  uint link_count = word >> 25;
  uint lanes = ((2u << (link_count >> 1)) - 1u) << (Lane() - lane_of_strip);
  return LaneOfStrip(word & 0x3ffu, word >> 10 & 0x3ffu, 2u * lane_of_strip, link_count, lanes);
}

bool HasFirstLink(LaneOfStrip mine) { return mine.k < mine.link_count; }
bool HasSecondLink(LaneOfStrip mine) { return mine.k + 1u < mine.link_count; }

LaneSlotWords LoadLaneSlot(uint slot) {
  uint begin = cloth.model.strip_lanes + DRAPE_STRIP_LANE_WORDS * slot;
  LaneSlotWords words = NoLane();
  words.word = models[begin];
  words.place = models[begin + 1u];
  words.rest_length = ModelFloat(cloth.model.strip_lengths + words.place);
#ifndef HAS_REGULAR_STRIPS
  uint second_place = HasSecondLink(UnpackLane(words.word)) ? words.place + 1u : words.place;
  words.second_length = ModelFloat(cloth.model.strip_lengths + second_place);
#endif
  return words;
}

struct LaneRows {
  StripRow first;
  StripRow second;
};

StripRow RowOf(LinearisedLink link, float from_before, float from_after) {
  return FirstRow(link.diagonal, from_before, from_after,
                  StripRightSide(link.error.residual, substep.inverse_link_interval));
}

// `inverse_masses`: of the two particles of the lane and of the next one [1/kg].
LaneRows RowsOf(LaneOfStrip mine, LinearisedLink first, LinearisedLink second, vec3 inverse_masses) {
  // The effects of the impulses of neighbours [1/kg].
  Offer(vec4(second.direction, 0.0));
  vec3 direction_before = OfferOf(LaneBefore(1u)).xyz;
  float from_before = 0.0;
  if (mine.k > 0u) from_before = StripCoupling(direction_before, first.error.direction, inverse_masses.x);
  float of_first = StripCoupling(first.direction, second.error.direction, inverse_masses.y);
#ifdef HAS_START_DIRECTIONS
  float of_second = StripCoupling(second.direction, first.error.direction, inverse_masses.y);
  Offer(vec4(first.direction, 0.0));
  float from_after = StripCoupling(OfferOf(LaneAfter(1u)).xyz, second.error.direction, inverse_masses.z);
#else
  // Two links have the same effect on each other.
  float of_second = of_first;
  Offer(vec4(from_before));
  float from_after = OfferOf(LaneAfter(1u)).x;
#endif
  if (!HasSecondLink(mine)) from_after = 0.0;
  return LaneRows(RowOf(first, from_before, of_second), RowOf(second, of_first, from_after));
}

// A link that ends at a pin is eliminated from no other (ReduceRows in meet_strips.glsl).
struct PinsOfStrip {
  bool keeps_first;      // the first link of this lane ends at a pin: the second one is eliminated instead
  bool is_after_first;   // so does that of the lane before
  bool is_before_first;  // or of the lane after
  bool has_first;        // or of any lane
  uint next;             // the first lane, from this one on, with a link that ends at a pin; DRAPE_STRIP_LANES: none
};

const PinsOfStrip kNoPins = PinsOfStrip(false, false, false, false, DRAPE_STRIP_LANES);

// `inverse_masses`: of the second particle of the lane, and of the first one of the next lane [1/kg].
PinsOfStrip FindPins(LaneOfStrip mine, vec2 inverse_masses) {
  PinsOfStrip pins = kNoPins;
#ifdef HAS_PINS
  bool first_ends_at_pin = HasFirstLink(mine) && inverse_masses.x == 0.0;
  bool second_ends_at_pin = HasSecondLink(mine) && inverse_masses.y == 0.0;
  uint ending = (LanesWith(first_ends_at_pin || second_ends_at_pin) & mine.lanes) >> Lane();
  if (ending != 0u) pins.next = Lane() + uint(findLSB(ending));
  uint keeping = LanesWith(first_ends_at_pin) & mine.lanes;
  pins.keeps_first = first_ends_at_pin;
  pins.is_after_first = (keeping << 1 >> Lane() & 1u) != 0u;
  pins.is_before_first = (keeping >> 1 >> Lane() & 1u) != 0u;
  pins.has_first = HasAnyLane(first_ends_at_pin);
#endif
  return pins;
}

#ifdef KEEPS_LANES
uint PackPins(PinsOfStrip pins) {
  return pins.next | uint(pins.keeps_first) << 6 | uint(pins.is_after_first) << 7 | uint(pins.is_before_first) << 8;
}
PinsOfStrip UnpackPins(uint word) {
#ifdef HAS_PINS
  bool keeps_first = (word & 64u) != 0u;
  // Not kept: compilers must see that it is the same in all lanes.
  bool has_first = HasAnyLane(keeps_first);
  return PinsOfStrip(keeps_first, (word & 128u) != 0u, (word & 256u) != 0u, has_first, word & 63u);
#else
  return kNoPins;
#endif
}
#endif

// A row that is left after the lanes have eliminated one of their two.
struct KeptRow {
  StripRow row;
  float least;  // pivot
};

// Eliminates from the first row that of the link before, where that lane keeps its first one, then the first rows of
// this lane and the next from the second.
KeptRow KeepRow(inout LaneRows rows, PinsOfStrip pins) {
  // A pivot depends on particles on both sides, so its bound is lower than that of an elimination.
  precise float bound = MIN_STRIP_PIVOT / float(1u << cloth.strip_all_levels);
  float least = pins.next == Lane() ? MIN_STRIP_PIVOT_AT_PIN : bound;
  float least_of_first = least;
  if (pins.has_first) {
    Offer(PackRow(rows.second));
    ReducedRow reduced = ReduceRow(rows.first, UnpackRow(OfferOf(LaneBefore(1u))), rows.second, false, least);
    if (pins.is_after_first) {
      rows.first = reduced.row;
      least_of_first = least * reduced.inverse_pivot;
    }
  }
  Offer(PackRow(rows.first));
  ReducedRow reduced =
      ReduceRow(rows.second, rows.first, UnpackRow(OfferOf(LaneAfter(1u))), !pins.is_before_first, least);
  if (pins.keeps_first) return KeptRow(rows.first, least_of_first);
  return KeptRow(reduced.row, least * reduced.inverse_pivot);
}

// The impulse of the kept link of the lane [N s].
float ReduceKept(KeptRow kept, PinsOfStrip pins) {
  StripRow row = kept.row;
  float least = kept.least;
  // A constant number of rounds, for compilers to unroll.
  for (uint level = 0u; level < DRAPE_STRIP_LANE_LEVELS; ++level) {
    if (level + 1u < cloth.strip_all_levels) {
      uint stride = 1u << level;
      Offer(PackRow(row));
      // Rows that have none before or after have 0 times that of another lane.
      ReducedRow reduced = ReduceRow(row, UnpackRow(OfferOf(LaneBefore(stride))),
                                     UnpackRow(OfferOf(LaneAfter(stride))), Lane() + stride < pins.next, least);
      row = reduced.row;
      least = least * reduced.inverse_pivot;
    }
  }
#ifdef HAS_PINS
  Offer(vec4(row.right_side));
  float impulse_at_pin = OfferOf(min(pins.next, DRAPE_STRIP_LANES - 1u)).x;
  precise float impulse = row.right_side - row.after * impulse_at_pin;
  if (pins.next < DRAPE_STRIP_LANES && pins.next != Lane()) return impulse;
#endif
  return row.right_side;
}

// The impulses of both links of the lane [N s].
vec2 ReduceLinks(LaneRows rows, PinsOfStrip pins) {
  float kept = ReduceKept(KeepRow(rows, pins), pins);
  Offer(vec4(kept));
  precise float first = rows.first.right_side - rows.first.before * OfferOf(LaneBefore(1u)).x - rows.first.after * kept;
  vec2 impulses = vec2(first, kept);
  if (pins.has_first) {
    if (pins.keeps_first) impulses.x = kept;
    Offer(vec4(impulses.x));
    precise float second = rows.second.right_side - rows.second.after * OfferOf(LaneAfter(1u)).x;
    if (pins.keeps_first) impulses.y = second;
  }
  return impulses;
}

// The changes of velocity of both particles [m/s], each with the length of the link before it, or of the first one.
struct LaneChanges {
  vec3 first;
  float length_before_first;
  vec3 second;
  float length_before_second;
};

// The share of the impulses of the strip that moves no particle too far; 1 mostly.
float TakeShare(LaneOfStrip mine, LaneChanges changes) {
  bool is_far = MovesFar(changes.first, changes.length_before_first) ||
                MovesFar(changes.second, changes.length_before_second);
  if (!HasAnyLane(mine.link_count > 0u && is_far)) return 1.0;
  return ShareOfMove(TakeLargest(mine.lanes, max(MoveRatioSq(changes.first, changes.length_before_first),
                                           MoveRatioSq(changes.second, changes.length_before_second))));
}

void ApplyToLink(uint place, uint from, LinearisedLink link, float applied) {
  AccumulateImpulse(place, applied);
#ifdef HAS_IMPULSES
  precise vec3 pull = applied * link.direction;
  PullAtStripLink(place, from, StripEnds(place).y, pull);
#endif
}

void SolveLane(LaneSlotWords words, bool is_first_sweep) {
  if (!HasAnyLane(words.word != 0u)) return;
  LaneOfStrip mine = UnpackLane(words.word);
  LinkEnd a = LinkEnd(vec3(0.0), vec3(0.0), 0.0, 0.0);
  LinkEnd b = a;
  if (mine.link_count > 0u) a = LoadEnd(mine.first);
  if (HasFirstLink(mine)) b = LoadEnd(mine.second);
  LinkEnd c = TakeEndAfter(a);
  LinearisedLink first = NoLink(words.rest_length);
  if (HasFirstLink(mine)) first = LineariseLink(words.place, words.rest_length, a, b, is_first_sweep);
  LinearisedLink second = NoLink(SecondLength(words));
  if (HasSecondLink(mine)) second = LineariseLink(words.place + 1u, SecondLength(words), b, c, is_first_sweep);
  LaneRows rows = RowsOf(mine, first, second, vec3(a.inverse_mass, b.inverse_mass, c.inverse_mass));
#ifdef KEEPS_LANES
  PinsOfStrip pins = UnpackPins(words.pins);
#else
  PinsOfStrip pins = FindPins(mine, vec2(b.inverse_mass, c.inverse_mass));
#endif
  vec2 impulses = ReduceLinks(rows, pins);

  precise vec3 pull_of_first = impulses.x * first.direction;
  precise vec3 pull_of_second = impulses.y * second.direction;
  Offer(vec4(pull_of_second, SecondLength(words)));
  vec4 before = OfferOf(LaneBefore(1u));
  if (mine.k == 0u) before = vec4(vec3(0.0), words.rest_length);
  precise vec3 change_of_a = a.inverse_mass * (before.xyz - pull_of_first);
  precise vec3 change_of_b = b.inverse_mass * (pull_of_first - pull_of_second);
  float share = TakeShare(mine, LaneChanges(change_of_a, before.w, change_of_b, words.rest_length));
  bool has_error = IsBeyondTolerance(first) || IsBeyondTolerance(second);
  if (!IsActive(mine.lanes, has_error) || mine.link_count == 0u) return;
  MarkChanged();
  precise vec2 applied = impulses * share;
  if (HasFirstLink(mine)) ApplyToLink(words.place, mine.first, first, applied.x);
  if (HasSecondLink(mine)) ApplyToLink(words.place + 1u, mine.second, second, applied.y);
  if (a.inverse_mass != 0.0) SetVelocity(mine.first, AddScaled(a.velocity, share, change_of_a));
  if (b.inverse_mass != 0.0) SetVelocity(mine.second, AddScaled(b.velocity, share, change_of_b));
}

#ifdef KEEPS_LANES
// With the pins, which do not change within a step. Once the masses are known.
LaneSlotWords Kept(LaneSlotWords words) {
  LaneOfStrip mine = UnpackLane(words.word);
  Offer(vec4(InverseMass(mine.first)));
  words.pins = PackPins(FindPins(mine, vec2(InverseMass(mine.second), OfferOf(LaneAfter(1u)).x)));
  return words;
}
#endif
