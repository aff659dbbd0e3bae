#include "server/solver/gl_compute/impulse_words.h"

#include <bit>
#include <limits>

#include "server/scene/colliders.h"
#include "server/solver/gl_compute/gl_cloth.h"
#include "server/solver/gl_compute/packing.h"

namespace drape {

namespace {

using Eigen::Vector3d;

// Of a cloth: pins, and room for grips.
uint32_t HeldCount(const SceneModel& model, const ClothParameters& parameters) {
  return model.pin_count() + parameters.max_grips;
}

uint32_t PieceWords(uint32_t held_count, size_t collider_count) {
  return 6 * held_count + 12 * static_cast<uint32_t>(collider_count);
}

uint64_t ResultCount(const SceneModel& model, const ClothParameters& parameters) {
  const uint32_t held = HeldCount(model, parameters);
  return uint64_t{MeasurePieceCount(model)} * PieceWords(held, parameters.colliders.size()) +
         uint64_t{DRAPE_IMPULSE_HELD_WORDS} * held;
}

Vector3d VectorIn(std::span<const float> words, size_t first) {
  return {words[first], words[first + 1], words[first + 2]};
}

// A sum of stages/exact_pulls.glsl.
double ExactNumber(std::span<const float> words, size_t first) {
  const auto word = [&](size_t k) { return std::bit_cast<uint32_t>(words[first + k]); };
  const double low = static_cast<double>(uint64_t{word(1)} << 32 | word(0)) * 0x1p-64;
  return std::bit_cast<int32_t>(word(2)) + low;
}

}  // namespace

uint64_t CountImpulseWords(const PlannedCloth& cloth) {
  return DRAPE_IMPULSE_RECORD_WORDS + 2 * uint64_t{cloth.plan.schedule.size()} +
         3 * uint64_t{cloth.parameters.colliders.size()};
}

uint64_t LayOutImpulses(const PlannedCloth& cloth, uint64_t size, ImpulseRecord& record) {
  const SceneModel& model = cloth.model;
  const uint64_t particles = model.particle_count();
  const uint64_t colliders = cloth.parameters.colliders.size();
  const bool touches_itself = cloth.plan.Has(StepStage::kFindSelfContacts);
  const auto append = [&](uint32_t member, uint64_t words) {
    record[member] = static_cast<uint32_t>(size);
    size += words;
  };
  append(DRAPE_IMPULSE_PULLS, 3 * particles);
  append(DRAPE_IMPULSE_VECTORS, 3 * CountPullVectors(model));
  append(DRAPE_IMPULSE_CONTACTS, 6 * colliders * particles);
  append(DRAPE_IMPULSE_EXACT_PULLS, touches_itself ? DRAPE_EXACT_WORDS * particles : 0);
  append(DRAPE_IMPULSE_ZONE_PULLS, touches_itself ? DRAPE_EXACT_WORDS * particles : 0);
  append(DRAPE_IMPULSE_SUMS_END, 0);
  append(DRAPE_IMPULSE_LANES,
         uint64_t{2 * 6 * DRAPE_IMPULSE_LANE_COUNT} * MeasurePieceCount(model) * colliders);
  append(DRAPE_IMPULSE_RESULTS, ResultCount(model, cloth.parameters));
  record[DRAPE_IMPULSE_HAS_EXACT] = touches_itself ? 1 : 0;
  return size;
}

std::vector<uint32_t> PackImpulses(const GlCloth& cloth) {
  const ImpulseRoom& room = cloth.impulses;
  const SubstepSchedule& schedule = cloth.plan.schedule;
  ImpulseRecord record = room.record;
  for (uint32_t member = DRAPE_IMPULSE_PULLS; member <= DRAPE_IMPULSE_RESULTS; ++member) {
    record[member] += cloth.scratch.begin();
  }
  record[DRAPE_IMPULSE_LIST_OFFSETS] = room.lists->words.begin();
  record[DRAPE_IMPULSE_LISTS] = room.lists->words.begin() + cloth.particle_count() + 1;
  record[DRAPE_IMPULSE_WEIGHTS] = room.words.begin() + DRAPE_IMPULSE_RECORD_WORDS;
  record[DRAPE_IMPULSE_PIVOTS] = record[DRAPE_IMPULSE_WEIGHTS] + 2 * schedule.size();
  record[DRAPE_IMPULSE_HAS_CONTACTS] = cloth.tells_contacts ? 1 : 0;
  record[DRAPE_IMPULSE_ELASTIC_S] = FloatWord(schedule.largest_force_interval_s2());
  std::vector<uint32_t> words(record.begin(), record.end());
  for (uint32_t index = 0; index < schedule.size(); ++index) {
    const ImpulseWeights weights =
        ImpulseWeightsOf(schedule, index, cloth.parameters.damping_per_s);
    words.insert(words.end(), {FloatWord(weights.impulse), FloatWord(weights.memory)});
  }
  for (const Collider& collider : cloth.parameters.colliders) {
    const Vector3d centre_m = CentreOf(collider);
    for (int axis = 0; axis < 3; ++axis) words.push_back(FloatWord(centre_m[axis]));
  }
  return words;
}

ResultWords ImpulseResultsOf(const GlCloth& cloth) {
  return {cloth.scratch.begin() + cloth.impulses.record[DRAPE_IMPULSE_RESULTS],
          static_cast<uint32_t>(ResultCount(*cloth.model->model, cloth.parameters))};
}

ResultWords ContactWordsOf(const GlCloth& cloth) {
  const uint32_t begin = cloth.impulses.record[DRAPE_IMPULSE_CONTACTS];
  return {cloth.scratch.begin() + begin,
          cloth.tells_contacts ? cloth.impulses.record[DRAPE_IMPULSE_ZONE_PULLS] - begin : 0};
}

uint32_t CountClearingGroups(const GlCloth& cloth) {
  const ImpulseRecord& record = cloth.impulses.record;
  const uint32_t words = record[DRAPE_IMPULSE_SUMS_END] - record[DRAPE_IMPULSE_PULLS];
  return (words + DRAPE_IMPULSE_CLEARED_WORDS - 1) / DRAPE_IMPULSE_CLEARED_WORDS;
}

namespace {

// From the words of ContactWordsOf.
std::vector<ParticleImpulse> ContactsFrom(const GlCloth& cloth, std::span<const float> words) {
  const uint32_t particles = cloth.particle_count();
  const auto colliders = static_cast<uint32_t>(cloth.parameters.colliders.size());
  const std::span<const float> exact = words.subspan(size_t{6} * colliders * particles);
  std::vector<ParticleImpulse> contacts;
  const auto add = [&](uint32_t i, uint32_t collider, const Vector3d& impulse) {
    if (!impulse.isZero(0)) contacts.push_back({i, collider, impulse});
  };
  for (uint32_t i = 0; i < particles; ++i) {
    for (uint32_t c = 0; c < colliders; ++c) {
      add(i, c, VectorIn(words, size_t{6} * (size_t{c} * particles + i)));
    }
    if (exact.empty()) continue;
    const size_t first = size_t{DRAPE_EXACT_WORDS} * i;
    add(i, ParticleImpulse::kCloth,
        {ExactNumber(exact, first), ExactNumber(exact, first + 3), ExactNumber(exact, first + 6)});
  }
  return contacts;
}

}  // namespace

StepImpulses ImpulsesFrom(const GlCloth& cloth, std::span<const float> results,
                          std::span<const float> contacts) {
  const SceneModel& model = *cloth.model->model;
  const ClothParameters& parameters = cloth.parameters;
  const uint32_t held = HeldCount(model, parameters);
  const uint32_t piece_words = PieceWords(held, parameters.colliders.size());
  const uint32_t pieces = MeasurePieceCount(model);
  // Of the vector at `word` of each piece, whose lost part is `lost` words behind it.
  const auto sum = [&](size_t word, size_t lost) {
    Vector3d total = Vector3d::Zero();
    for (size_t begin = 0; begin < size_t{pieces} * piece_words; begin += piece_words) {
      total += VectorIn(results, begin + word) + VectorIn(results, begin + word + lost);
    }
    return total;
  };
  StepImpulses impulses;
  for (size_t c = 0; c < parameters.colliders.size(); ++c) {
    const size_t word = size_t{6} * held + 12 * c;
    impulses.colliders.push_back({-sum(word, 6), -sum(word + 3, 6)});
  }
  const Vector3d fall = parameters.settings.time_step_s * parameters.gravity_m_per_s2;
  for (uint32_t k = 0; k < held; ++k) {
    const bool is_pin = k < model.pin_count();
    const uint32_t i = is_pin ? model.pins()[k] : cloth.grip_words[k - model.pin_count()];
    if (i == DRAPE_NO_PARTICLE) continue;
    const size_t word = size_t{pieces} * piece_words + size_t{DRAPE_IMPULSE_HELD_WORDS} * k;
    const Vector3d change = VectorIn(results, word + 3) - VectorIn(results, word);
    const Vector3d exact(ExactNumber(results, word + 6), ExactNumber(results, word + 9),
                         ExactNumber(results, word + 12));
    const Vector3d impulse =
        sum(size_t{6} * k, 3) + exact + model.masses_kg()[i] * Vector3d(fall - change);
    if (is_pin) {
      impulses.pins_n_s.push_back(impulse);
    } else {
      impulses.grips_n_s.push_back(impulse);
      impulses.gripped_particles.push_back(i);
    }
  }
  if (cloth.tells_contacts) impulses.contacts = ContactsFrom(cloth, contacts);
  return impulses;
}

StepImpulses UnknownImpulses(const GlCloth& cloth) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const std::vector<float> results(ImpulseResultsOf(cloth).count, static_cast<float>(kUnknown));
  const size_t colliders = cloth.parameters.colliders.size();
  // Those of colliders alone: any bits make a number of an exact sum.
  const std::vector<float> contacts(
      cloth.tells_contacts ? 6 * colliders * cloth.particle_count() : 0,
      static_cast<float>(kUnknown));
  StepImpulses impulses = ImpulsesFrom(cloth, results, contacts);
  if (!impulses.contacts || !cloth.touches_itself()) return impulses;
  for (uint32_t i = 0; i < cloth.particle_count(); ++i) {
    impulses.contacts->push_back({i, ParticleImpulse::kCloth, Vector3d::Constant(kUnknown)});
  }
  SortContacts(*impulses.contacts);
  return impulses;
}

}  // namespace drape
