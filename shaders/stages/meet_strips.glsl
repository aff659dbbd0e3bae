// Stage `solve_strips` from both ends (server/solver/method.md, "solve_strips"), by a work group: each invocation
// linearises a link, two per strip eliminate its rows from its ends towards the middle and substitute back, and each
// applies the impulse of its link. So nothing but the pivots is found one after the other. Needs the accessors of one
// plan, StripEnds and STRIP_ROWS.
#include "stages/solve_strips.glsl"

// A block of strips has at most STRIP_ROWS links, the size of the work group, and half as many strips.
const uint kRowPlaces = uint(STRIP_ROWS) + uint(STRIP_ROWS) / 32u;

// Four numbers of each link of a block, by the steps of MeetStrips:
//   x  -             effect of the impulse before on this error [1/kg]; at the first link of a strip: whether any of
//                    the strip has an error larger than the tolerance
//   y  direction.x   effect of the impulse after on this error [1/kg]                                    pull.x [N s]
//   z  direction.y   diagonal [1/kg], negative if `to` is a pin; ratio of EliminateRow                   pull.y
//   w  direction.z   right side [m/s]; over the pivot [N s]; impulse [N s]                               pull.z
// and at the last link of a half until it has met the other: x or y, whichever the half has used, the inverse pivot,
// z the least pivot over the pivot. The links of a strip are neighbours, and strips an odd number of rows apart where
// there is room: those who eliminate then meet no bank twice.
shared vec4 shared_rows[kRowPlaces];
shared uint shared_pins[(kRowPlaces + 31u) / 32u];  // a bit for each row whose `to` is a pin
shared uint shared_has_excess;  // whether a particle of the block moves too far

vec3 RowVector(uint row) {
  vec4 numbers = shared_rows[row];
  return vec3(numbers.y, numbers.z, numbers.w);
}

void FlagPin(uint row) { atomicOr(shared_pins[row >> 5], 1u << (row & 31u)); }

// Whether any `to` of the rows [begin, end) is a pin.
bool HasPin(uint begin, uint end) {
  bool has_pin = false;
#ifdef HAS_PINS
  for (uint word = begin >> 5; 32u * word < end; ++word) {
    uint from_begin = 32u * word < begin ? ~0u << (begin & 31u) : ~0u;
    uint to_end = 32u * word + 32u > end ? ~(~0u << (end & 31u)) : ~0u;
    if ((shared_pins[word] & from_begin & to_end) != 0u) has_pin = true;
  }
#endif
  return has_pin;
}

// The place of a link in its strip, and of its row.
struct Turn {
  uint k;
  uint link_count;  // of the strip
  uint row;
};

Turn LoadTurn(uint place) {
  uint word = models[cloth.model.strip_turns + place];
  return Turn(word & 0x3ffu, (word >> 10 & 0x3ffu) + 1u, word >> 20);
}

// A link of this invocation.
struct SideLink {
  bool is_link;
  uint place;  // in the lists of links
  Turn turn;
  uint from;  // particles
  uint to;
  LinearisedLink link;
  float impulse;   // [N s]
  bool is_active;  // any link of its strip has an error larger than the tolerance
};

uint FirstRow(Turn turn) { return turn.row - turn.k; }
bool HasNext(Turn turn) { return turn.k + 1u < turn.link_count; }

SideLink LoadSideLink(uint place, uint end, bool is_first_sweep) {
  DistanceError no_error = DistanceError(vec3(0.0), 0.0);
  SideLink mine = SideLink(place < end, place, Turn(0u, 0u, 0u), 0u, 0u,
                           LinearisedLink(0.0, no_error, vec3(0.0), 1.0), 0.0, false);
  if (!mine.is_link) return mine;
  uvec2 ends = StripEnds(place);
  float rest_length = ModelFloat(cloth.model.strip_lengths + place);
  mine.turn = LoadTurn(place);
  mine.from = ends.x;
  mine.to = ends.y;
  mine.link = LineariseLink(place, rest_length, LoadEnd(mine.from), LoadEnd(mine.to), is_first_sweep);
  return mine;
}

// The effects of its neighbours' impulses on its error, before and after it [1/kg].
vec2 LoadNeighbours(SideLink mine) {
  vec2 effects = vec2(0.0);
  if (!mine.is_link) return effects;
  vec3 n_end = mine.link.error.direction;
  if (mine.turn.k > 0u) {
    effects.x = StripCoupling(RowVector(mine.turn.row - 1u), n_end, InverseMass(mine.from));
  }
  if (HasNext(mine.turn)) {
    effects.y = StripCoupling(RowVector(mine.turn.row + 1u), n_end, InverseMass(mine.to));
  }
  return effects;
}

void StoreRow(SideLink mine, vec2 effects) {
  if (!mine.is_link) return;
  float diagonal = mine.link.diagonal;
#ifdef HAS_PINS
  if (InverseMass(mine.to) == 0.0) {
    diagonal = -diagonal;
    FlagPin(mine.turn.row);
  }
#endif
  float right_side = StripRightSide(mine.link.error.residual, substep.inverse_interval);
  if (mine.turn.k > 0u) {
    shared_rows[mine.turn.row] = vec4(effects, diagonal, right_side);
  } else {  // whose x others write
    shared_rows[mine.turn.row].y = effects.y;
    shared_rows[mine.turn.row].z = diagonal;
    shared_rows[mine.turn.row].w = right_side;
  }
  if (IsBeyondTolerance(mine.link)) shared_rows[FirstRow(mine.turn)].x = 1.0;  // all writers write the same
}

// One end of the elimination.
struct HalfStrip {
  bool is_second;  // which goes backwards
  uint row_count;  // 0: there is none, or nothing to do
  uint row;        // the last one
  bool has_other;  // the other half has rows
  float ratio;     // there
  float impulse;   // of the last link, at first without the other half [N s]
};

// Between two pins a strip has a link too many, whose pivot the elimination raises where it ends at a pin. Backwards
// that would be another link, with other impulses; so a strip with pins in its second half is not divided.
HalfStrip HalfOf(Turn strip, bool is_second) {
  HalfStrip half_strip = HalfStrip(is_second, 0u, strip.row, false, 0.0, 0.0);
  if (strip.link_count == 0u || shared_rows[strip.row].x == 0.0) return half_strip;
  // Of three links at least, so that its last row is not the one with the flag.
  uint of_first = strip.link_count > 2u ? (strip.link_count + 1u) / 2u : strip.link_count;
  if (HasPin(strip.row + of_first, strip.row + strip.link_count)) of_first = strip.link_count;
  half_strip.row_count = is_second ? strip.link_count - of_first : of_first;
  half_strip.row += is_second ? of_first : of_first - 1u;
  half_strip.has_other = of_first < strip.link_count;
  return half_strip;
}

// Eliminates the rows of a half up to the last one, and leaves there what the other half needs of it. Each pass reads
// the row of the next one: a single invocation waits for every result.
void EliminateRows(inout HalfStrip half_strip) {
  bool is_second = half_strip.is_second;
  uint step = is_second ? ~0u : 1u;
  uint place = half_strip.row - step * (half_strip.row_count - 1u);
  bool ends_at_pin_at_last = is_second && HasPin(half_strip.row - 1u, half_strip.row);
  vec4 row = shared_rows[place];
  float coupling = 0.0;
  float effect_on_before = 0.0;
  float inverse_pivot = 0.0;
  float right_side = 0.0;
  precise float ratio = 0.0;
  precise float least_share = 0.0;
  for (uint left = half_strip.row_count; left > 0u; --left) {
    uint next_place = left > 1u ? place + step : place;
    vec4 next = shared_rows[next_place];
    float diagonal = abs(row.z);
    bool ends_at_pin = is_second ? ends_at_pin_at_last && left == 1u : row.z < 0.0;
    float min_pivot = MinPivot(ends_at_pin ? 0.0 : 1.0);
    ratio = effect_on_before * inverse_pivot;
    StripPivot pivot = EliminateRow(diagonal, min_pivot, row.w, coupling, ratio, right_side);
    least_share = min_pivot * diagonal;
    inverse_pivot = pivot.inverse_pivot;
    right_side = pivot.right_side;
    shared_rows[place].z = ratio;
    shared_rows[place].w = right_side;
    coupling = is_second ? next.y : next.x;
    effect_on_before = is_second ? row.x : row.y;
    row = next;
    place = next_place;
  }
  half_strip.ratio = ratio;
  half_strip.impulse = right_side;
  if (!half_strip.has_other) return;
  least_share = least_share * inverse_pivot;
  if (is_second) {
    shared_rows[half_strip.row].y = inverse_pivot;
  } else {
    shared_rows[half_strip.row].x = inverse_pivot;
  }
  shared_rows[half_strip.row].z = least_share;
}

// The impulse of the last link of a half, together with that of the other half [N s].
float MeetingImpulse(HalfStrip half_strip) {
  vec4 mine = shared_rows[half_strip.row];
  vec4 other = shared_rows[half_strip.is_second ? half_strip.row - 1u : half_strip.row + 1u];
  // Effects on the error of a link over its pivot.
  precise float mine_of_other = mine.x * mine.y;
  precise float other_of_mine = other.x * other.y;
  precise float pivot = 1.0 - mine_of_other * other_of_mine;  // over that of either link
  float inverse_pivot = Quotient(1.0, max(pivot, max(mine.z, other.z)));
  precise float alone = mine.w - mine_of_other * other.w;
  precise float impulse = alone * inverse_pivot;
  return impulse;
}

// Replaces the right sides of the rows of a half by its impulses, from the last one back.
void SubstituteBack(HalfStrip half_strip) {
  uint step = half_strip.is_second ? 1u : ~0u;
  uint place = half_strip.row;
  precise float impulse = half_strip.impulse;
  precise float effect = half_strip.ratio * impulse;  // on the next one
  shared_rows[place].w = impulse;
  if (half_strip.row_count == 1u) return;
  place += step;
  vec4 row = shared_rows[place];
  for (uint left = half_strip.row_count - 1u; left > 0u; --left) {
    uint next_place = left > 1u ? place + step : place;
    vec4 next = shared_rows[next_place];
    impulse = row.w - effect;
    effect = row.z * impulse;
    shared_rows[place].w = impulse;
    row = next;
    place = next_place;
  }
}

// Whether MoveRatioSq of this change is above 1, without the quotient.
bool MovesFar(vec3 change, float rest_length) {
  precise float limit = rest_length * (MAX_STRIP_MOVE * substep.inverse_interval);
  precise float limit_sq = limit * limit;
  return Dot(change, change) > limit_sq;
}

// The changes of velocity of the particles of a link, its second one and, at the first link of a strip, its first one,
// by the pulls in the rows [m/s].
struct EndChanges {
  vec3 of_to;
  vec3 of_from;
};

EndChanges ChangesOfEnds(SideLink mine) {
  vec3 pull = RowVector(mine.turn.row);
  vec3 pull_of_next = HasNext(mine.turn) ? RowVector(mine.turn.row + 1u) : vec3(0.0);
  precise vec3 of_to = InverseMass(mine.to) * (pull - pull_of_next);
  precise vec3 of_from = vec3(0.0);
  if (mine.turn.k == 0u) of_from = InverseMass(mine.from) * -pull;
  return EndChanges(of_to, of_from);
}

void ChangeVelocity(uint i, vec3 change) {
  precise vec3 velocity = Velocity(i) + change;
  if (InverseMass(i) != 0.0) SetVelocity(i, velocity);
}

void ChangeEnds(SideLink mine, EndChanges changes) {
  ChangeVelocity(mine.to, changes.of_to);
  if (mine.turn.k == 0u) ChangeVelocity(mine.from, changes.of_from);
}

void StorePull(SideLink mine, float share) {
  precise float applied = share * mine.impulse;
  AccumulateImpulse(mine.place, applied);
  precise vec3 pull = applied * mine.link.direction;
  shared_rows[mine.turn.row].y = pull.x;  // x may be the flag that others read
  shared_rows[mine.turn.row].z = pull.y;
  shared_rows[mine.turn.row].w = pull.z;
}

// The impulses moved particles too far, which is rare: takes back what is too much in each strip.
void RemoveExcess(SideLink mine) {
  float ratio_sq = 0.0;
  if (mine.is_active) {
    EndChanges changes = ChangesOfEnds(mine);
    ratio_sq = max(MoveRatioSq(changes.of_to, mine.link.rest_length),
                   MoveRatioSq(changes.of_from, mine.link.rest_length));
  }
  PhaseBarrier();
  if (mine.is_active) shared_rows[mine.turn.row].x = ratio_sq;
  PhaseBarrier();
  precise float back = 0.0;
  if (mine.is_active) {
    float largest_ratio_sq = 0.0;
    for (uint k = 0u; k < mine.turn.link_count; ++k) {
      largest_ratio_sq = max(largest_ratio_sq, shared_rows[FirstRow(mine.turn) + k].x);
    }
    back = ShareOfMove(largest_ratio_sq) - 1.0;
  }
  PhaseBarrier();
  if (back != 0.0) StorePull(mine, back);
  PhaseBarrier();
  if (back != 0.0) ChangeEnds(mine, ChangesOfEnds(mine));
}

// The strips [begin, end), a block. In uniform control flow.
void MeetStrips(uint begin, uint end, bool is_first_sweep) {
  uint lane = gl_LocalInvocationID.x;
  uint first_link = models[cloth.model.strip_offsets + begin];
  uint end_link = models[cloth.model.strip_offsets + end];
  Turn strip = Turn(0u, 0u, 0u);  // of which this invocation eliminates a half
  if (lane < 2u * (end - begin)) strip = LoadTurn(models[cloth.model.strip_offsets + begin + lane / 2u]);
  SideLink mine = LoadSideLink(first_link + lane, end_link, is_first_sweep);
  if (mine.is_link) shared_rows[mine.turn.row] = vec4(0.0, mine.link.direction);
  if (lane < (kRowPlaces + 31u) / 32u) shared_pins[lane] = 0u;
  if (lane == 0u) shared_has_excess = 0u;
  PhaseBarrier();
  vec2 effects = LoadNeighbours(mine);
  PhaseBarrier();
  StoreRow(mine, effects);
  PhaseBarrier();

  HalfStrip half_strip = HalfOf(strip, lane % 2u == 1u);
  if (half_strip.row_count > 0u) EliminateRows(half_strip);
  PhaseBarrier();
  if (half_strip.has_other) half_strip.impulse = MeetingImpulse(half_strip);
  PhaseBarrier();
  if (half_strip.row_count > 0u) SubstituteBack(half_strip);
  PhaseBarrier();

  if (mine.is_link) {
    mine.is_active = shared_rows[FirstRow(mine.turn)].x != 0.0;
    mine.impulse = shared_rows[mine.turn.row].w;
  }
  if (mine.is_active) StorePull(mine, 1.0);
  PhaseBarrier();
  if (mine.is_active) {
    MarkChanged();
    EndChanges changes = ChangesOfEnds(mine);
    ChangeEnds(mine, changes);
    bool moves_far =
        MovesFar(changes.of_to, mine.link.rest_length) || MovesFar(changes.of_from, mine.link.rest_length);
    if (moves_far) shared_has_excess = 1u;  // all writers write the same
  }
  PhaseBarrier();
  if (shared_has_excess != 0u) RemoveExcess(mine);
}
