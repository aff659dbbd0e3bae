// Stage `solve_strips` by cyclic reduction (server/solver/method.md, "solve_strips"): each lane has a particle of a
// strip and the link from there to the next one, and all links are solved at once. A group of lanes has whole strips,
// as many as fit. So a phase needs no barrier. Resident plan only. Needs strip_lanes.glsl;
// solve_lanes.glsl calls it.

// What a lane takes of a phase.
struct LaneSlotWords {
  uint word;          // particle | place of the particle in its strip << 10 | links of the strip << 15; 0: nothing
  uint place;         // of the link in the lists of links; meaningless at the last particle
  float rest_length;  // of that link [m]
};

LaneSlotWords LoadLaneSlot(uint slot) {
  uint word = cloth.model.strip_lanes + DRAPE_STRIP_LANE_WORDS * slot;
  uint place = models[word + 1u];
  return LaneSlotWords(models[word], place, ModelFloat(cloth.model.strip_lengths + place));
}

LaneSlotWords NoLane() { return LaneSlotWords(0u, 0u, 1.0); }

// What does not change within a step is in the words.
LaneSlotWords WithPins(LaneSlotWords words) { return words; }

bool HasWork(LaneSlotWords words) { return words.word != 0u; }

struct LaneOfStrip {
  uint particle;
  uint k;           // of the particle in its strip
  uint link_count;  // of the strip; 0: this lane has nothing to do
  uint lanes;       // a bit per lane of the strip
};

LaneOfStrip UnpackLane(uint word) {
  uint k = word >> 10 & 31u;
  uint link_count = word >> 15;
  uint lanes = ((2u << link_count) - 1u) << (Lane() - k);
  return LaneOfStrip(word & 0x3ffu, k, link_count, lanes);
}

// The effects of the impulses of the links before and after on the error of this one [1/kg]: 0 where there is none,
// for lanes without a link have the direction 0.
vec2 TakeEffects(LaneOfStrip mine, LinearisedLink link, float inverse_mass, float inverse_mass_of_to) {
  Offer(vec4(link.direction, 0.0));
  vec3 direction_before = OfferOf(LaneBefore(1u)).xyz;
  float from_before = 0.0;
  if (mine.k > 0u) from_before = StripCoupling(direction_before, link.error.direction, inverse_mass);
#ifdef HAS_START_DIRECTIONS
  float from_after = StripCoupling(OfferOf(LaneAfter(1u)).xyz, link.error.direction, inverse_mass_of_to);
#else
  // Two links have the same effect on each other.
  Offer(vec4(from_before));
  float from_after = OfferOf(LaneAfter(1u)).x;
#endif
  return vec2(from_before, from_after);
}

// The first lane, from this one on, whose link ends at a pin; DRAPE_STRIP_LANES if there is none. That link is
// eliminated from no other (ReduceRows in meet_strips.glsl).
uint TakePin(LaneOfStrip mine, bool ends_at_pin) {
#ifdef HAS_PINS
  uint pins = (LanesWith(ends_at_pin) & mine.lanes) >> Lane();
  return pins != 0u ? Lane() + uint(findLSB(pins)) : DRAPE_STRIP_LANES;
#else
  return DRAPE_STRIP_LANES;
#endif
}

// The impulse of the link with this equation [N s].
float ReduceLink(LaneOfStrip mine, StripRow row, bool ends_at_pin) {
  uint pin = TakePin(mine, ends_at_pin);
  // A pivot depends on particles on both sides, so its bound is lower than that of an elimination.
  precise float least =
      ends_at_pin ? MIN_STRIP_PIVOT_AT_PIN : MIN_STRIP_PIVOT / float(1u << cloth.strip_all_levels);
  // A constant number of rounds, for compilers to unroll.
  for (uint level = 0u; level < DRAPE_STRIP_LANE_LEVELS; ++level) {
    if (level < cloth.strip_all_levels) {
      uint stride = 1u << level;
      Offer(PackRow(row));
      // Rows that have none before or after have 0 times that of another lane.
      ReducedRow reduced = ReduceRow(row, UnpackRow(OfferOf(LaneBefore(stride))),
                                     UnpackRow(OfferOf(LaneAfter(stride))), Lane() + stride < pin, least);
      row = reduced.row;
      least = least * reduced.inverse_pivot;
    }
  }
#ifdef HAS_PINS
  Offer(vec4(row.right_side));
  float impulse_at_pin = OfferOf(min(pin, DRAPE_STRIP_LANES - 1u)).x;
  precise float impulse = row.right_side - row.after * impulse_at_pin;
  if (pin < DRAPE_STRIP_LANES && pin != Lane()) return impulse;
#endif
  return row.right_side;
}

// The share of the impulses of the strip that moves no particle too far; 1 mostly. `rest_length`: of the link before
// the particle, or of the first one [m].
float TakeShare(LaneOfStrip mine, vec3 change, float rest_length) {
  if (!HasAnyLane(mine.link_count > 0u && MovesFar(change, rest_length))) return 1.0;
  return ShareOfMove(TakeLargest(mine.lanes, MoveRatioSq(change, rest_length)));
}

void SolveLane(LaneSlotWords words, bool is_first_sweep) {
  LaneOfStrip mine = UnpackLane(words.word);
  bool is_link = mine.k < mine.link_count;
  LinkEnd from = LinkEnd(vec3(0.0), vec3(0.0), 0.0, 0.0);
  if (mine.link_count > 0u) from = LoadEnd(mine.particle);
  LinkEnd to = TakeEnd(from, LaneAfter(1u));
  LinearisedLink link = NoLink(words.rest_length);
  if (is_link) link = LineariseLink(words.place, words.rest_length, from, to, is_first_sweep);
  vec2 effects = TakeEffects(mine, link, from.inverse_mass, to.inverse_mass);
  StripRow row = FirstRow(link.diagonal, effects.x, effects.y,
                          StripRightSide(link.error.residual, substep.inverse_link_interval));
  float impulse = ReduceLink(mine, row, is_link && to.inverse_mass == 0.0);

  precise vec3 pull = impulse * link.direction;
  Offer(vec4(pull, words.rest_length));
  vec4 before = OfferOf(LaneBefore(1u));
  if (mine.k == 0u) before = vec4(vec3(0.0), words.rest_length);
  precise vec3 change = from.inverse_mass * (before.xyz - pull);
  float share = TakeShare(mine, change, before.w);
  if (!IsActive(mine.lanes, IsBeyondTolerance(link)) || mine.link_count == 0u) return;
  MarkChanged();
  precise float applied = share * impulse;
  if (is_link) AccumulateImpulse(words.place, applied);
#ifdef HAS_IMPULSES
  precise vec3 applied_pull = applied * link.direction;
  if (is_link) {
    PullAtStripLink(words.place, mine.particle, StripEnds(words.place).y, applied_pull);
  }
#endif
  if (from.inverse_mass != 0.0) SetVelocity(mine.particle, AddScaled(from.velocity, share, change));
}
