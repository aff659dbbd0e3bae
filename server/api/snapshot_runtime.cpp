#include "server/api/snapshot_runtime.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <utility>

#include "server/api/snapshot_motions.h"

namespace drape::api {
namespace {

using Eigen::Vector3d;

// The order of RuntimeSnapshot.warnings.
constexpr std::array kCounters = {
    &WarningCounters::tolerance_raised,     &WarningCounters::not_converged,
    &WarningCounters::springs_beyond_limit, &WarningCounters::elastic_beyond_limit,
    &WarningCounters::springs_gain_energy,  &WarningCounters::energy_gained,
    &WarningCounters::over_budget,          &WarningCounters::strain_beyond_limit,
    &WarningCounters::starts_crossing,      &WarningCounters::contacts_given_up};
// The bits of SleepReport.warnings, lowest first.
constexpr std::array kStepWarnings = {
    &StepWarnings::tolerance_raised,     &StepWarnings::not_converged,
    &StepWarnings::springs_beyond_limit, &StepWarnings::elastic_beyond_limit,
    &StepWarnings::energy_gained,        &StepWarnings::springs_gain_energy,
    &StepWarnings::over_budget,          &StepWarnings::strain_beyond_limit,
    &StepWarnings::starts_crossing,      &StepWarnings::contacts_given_up};
// The order of SleepReport.measurements.
constexpr std::array kMeasurements = {
    &Measurements::max_strain,         &Measurements::rms_strain,
    &Measurements::strain_p50,         &Measurements::strain_p90,
    &Measurements::strain_p99,         &Measurements::rms_motion_m,
    &Measurements::kinetic_energy_j,   &Measurements::potential_energy_j,
    &Measurements::strain_energy_j,    &Measurements::lowest_m,
    &Measurements::max_penetration_m,  &Measurements::max_residual_m,
    &Measurements::smallest_distance_m};
// The order of SleepReport.counts; after them iterations and iteration_cap.
constexpr std::array kCounts = {&Measurements::contacts, &Measurements::near_pairs,
                                &Measurements::crossings};

// Of what a cloth may have gained: far more than any has.
constexpr double kMaxEnergy_j = 1e30;

v1::RuntimeSnapshot::Grips ToMessage(const GripTrack& grips) {
  v1::RuntimeSnapshot::Grips message;
  for (const GripTrack::Slot& slot : grips.slots()) {
    message.add_particles(slot.particle ? static_cast<int32_t>(*slot.particle) : -1);
    AppendValue(slot.offset_m, message.mutable_offsets_m());
    AppendMotion(slot.motion, *message.mutable_motions());
  }
  if (grips.has_largest_forces()) {
    for (const GripTrack::Slot& slot : grips.slots()) {
      const bool has_limit = slot.largest_force_n < GripTrack::kNoLimit_n;
      message.add_largest_forces_n(has_limit ? slot.largest_force_n : 0);
    }
  }
  message.mutable_motions()->set_is_settled(grips.is_settled());
  return message;
}

// Whether the first `count` slots leave the particle to the next one.
bool MayHold(const std::vector<GripTrack::Slot>& slots, uint32_t particle,
             const SceneModel& model) {
  return particle < model.particle_count() && model.inverse_masses_per_kg()[particle] != 0 &&
         std::ranges::none_of(slots, [&](const auto& slot) { return slot.particle == particle; });
}

GripTrack CheckGrips(const FieldPath& path, const v1::RuntimeSnapshot::Grips& message,
                     const RuntimeOwner& owner, Violations& violations) {
  const size_t count = owner.on_device.max_grips;
  GripTrack track;
  const auto motions =
      CheckMotions<Vector3d>(path.Child("motions"), message.motions(), count, false, violations);
  if (!(violations.Length(path.Child("particles"), static_cast<size_t>(message.particles_size()),
                          count, "max_grips") &
        violations.Length(path.Child("offsets_m"), static_cast<size_t>(message.offsets_m_size()),
                          3 * count, "3 per grip") &
        (message.largest_forces_n().empty() ||
         violations.Length(path.Child("largest_forces_n"),
                           static_cast<size_t>(message.largest_forces_n_size()), count,
                           "max_grips"))) ||
      motions.size() != count) {
    return track;
  }
  std::vector<GripTrack::Slot> slots;
  for (size_t k = 0; k < count; ++k) {
    GripTrack::Slot slot{.particle = {},
                         .offset_m = Vector3d(message.offsets_m().data() + 3 * k),
                         .motion = motions[k]};
    bool is_legal = IsWithin(slot.offset_m, 2 * kMaxTarget_m);
    if (!message.largest_forces_n().empty()) {
      const double force_n = message.largest_forces_n(static_cast<int>(k));
      is_legal &= force_n >= 0 && force_n <= kMaxGripForce_n;
      if (force_n > 0) slot.largest_force_n = force_n;
    }
    if (const int32_t particle = message.particles(static_cast<int>(k)); particle != -1) {
      slot.particle = static_cast<uint32_t>(particle);
      is_legal &= motions[k].goal.has_value() && MayHold(slots, *slot.particle, owner.model);
    }
    if (!violations.Require(is_legal, path.At(k), [] { return "is no grip of the cloth"; })) {
      return track;
    }
    slots.push_back(std::move(slot));
  }
  track.Restore(std::move(slots), message.motions().is_settled());
  return track;
}

v1::RuntimeSnapshot::SleepReport ToMessage(const StepReport& report) {
  v1::RuntimeSnapshot::SleepReport message;
  message.set_converged(report.converged);
  uint32_t bits = 0;
  for (size_t k = 0; k < kStepWarnings.size(); ++k) {
    bits |= uint32_t{report.warnings.*kStepWarnings[k]} << k;
  }
  message.set_warnings(bits);
  for (const auto member : kMeasurements) message.add_measurements(report.measured.*member);
  for (const auto member : kCounts) message.add_counts(report.measured.*member);
  message.add_counts(report.iterations);
  message.add_counts(report.iteration_cap);
  if (report.impulses == nullptr) return message;
  const StepImpulses& impulses = *report.impulses;
  for (const ColliderImpulse& collider : impulses.colliders) {
    AppendValue(collider.impulse_n_s, message.mutable_impulses_n_s());
    AppendValue(collider.angular_impulse_n_m_s, message.mutable_impulses_n_s());
  }
  for (const Vector3d& pin : impulses.pins_n_s) AppendValue(pin, message.mutable_impulses_n_s());
  for (const Vector3d& grip : impulses.grips_n_s) AppendValue(grip, message.mutable_impulses_n_s());
  message.mutable_gripped_particles()->Assign(impulses.gripped_particles.begin(),
                                              impulses.gripped_particles.end());
  message.set_has_contacts(impulses.contacts.has_value());
  if (!impulses.contacts) return message;
  for (const ParticleImpulse& contact : *impulses.contacts) {
    message.add_contact_particles(contact.particle);
    message.add_contact_colliders(contact.collider + 1);  // cloth: 0
    AppendValue(contact.impulse_n_s, message.mutable_impulses_n_s());
  }
  return message;
}

// Without their impulses.
std::vector<ParticleImpulse> CheckContacts(const FieldPath& path,
                                           const v1::RuntimeSnapshot::SleepReport& message,
                                           const RuntimeOwner& owner, Violations& violations) {
  std::vector<ParticleImpulse> contacts;
  if (!violations.Length(
          path.Child("contact_colliders"), static_cast<size_t>(message.contact_colliders_size()),
          static_cast<size_t>(message.contact_particles_size()), "one per contact_particle")) {
    return contacts;
  }
  const auto is_below = [&](const char* field, uint64_t value, uint64_t count) {
    return violations.Require(value < count, path.Child(field), [&] {
      return "is " + std::to_string(value) + "; legal: below " + std::to_string(count);
    });
  };
  for (int k = 0; k < message.contact_particles_size(); ++k) {
    const uint32_t particle = message.contact_particles(k);
    const uint32_t collider = message.contact_colliders(k);
    if (!is_below("contact_particles", particle, owner.model.particle_count()) ||
        !is_below("contact_colliders", collider, owner.on_device.colliders.size() + 1)) {
      return contacts;
    }
    contacts.push_back({.particle = particle, .collider = collider - 1});
  }
  return contacts;
}

// Null: unknown.
std::shared_ptr<const StepImpulses> CheckImpulses(const FieldPath& path,
                                                  const v1::RuntimeSnapshot::SleepReport& message,
                                                  const RuntimeOwner& owner,
                                                  Violations& violations) {
  // Each of them is looked for among the grips with every step.
  if (!violations.CountInRange(path.Child("gripped_particles"),
                               static_cast<uint64_t>(message.gripped_particles_size()), 0,
                               owner.on_device.max_grips)) {
    return nullptr;
  }
  auto impulses = std::make_shared<StepImpulses>();
  impulses->colliders.resize(owner.on_device.colliders.size());
  impulses->pins_n_s.resize(owner.model.pin_count());
  impulses->gripped_particles.assign(message.gripped_particles().begin(),
                                     message.gripped_particles().end());
  impulses->grips_n_s.resize(impulses->gripped_particles.size());
  if (message.has_contacts()) {
    impulses->contacts = CheckContacts(path, message, owner, violations);
  }
  const size_t vectors = 2 * impulses->colliders.size() + impulses->pins_n_s.size() +
                         impulses->grips_n_s.size() +
                         (impulses->contacts ? impulses->contacts->size() : 0);
  if (vectors > 0 && message.impulses_n_s().empty()) return nullptr;
  if (!violations.Length(path.Child("impulses_n_s"),
                         static_cast<size_t>(message.impulses_n_s_size()), 3 * vectors,
                         "3 per vector")) {
    return nullptr;
  }
  const double* numbers = message.impulses_n_s().data();
  const auto next = [&] { return Vector3d(std::exchange(numbers, numbers + 3)); };
  for (ColliderImpulse& collider : impulses->colliders) {
    collider.impulse_n_s = next();
    collider.angular_impulse_n_m_s = next();
  }
  for (Vector3d& pin : impulses->pins_n_s) pin = next();
  for (Vector3d& grip : impulses->grips_n_s) grip = next();
  if (!impulses->contacts) return impulses;
  for (ParticleImpulse& contact : *impulses->contacts) contact.impulse_n_s = next();
  return impulses;
}

StepReport CheckReport(const FieldPath& path, const v1::RuntimeSnapshot::SleepReport& message,
                       bool is_asleep, const RuntimeOwner& owner, Violations& violations) {
  StepReport report;
  if (!(violations.Length(path.Child("measurements"),
                          static_cast<size_t>(message.measurements_size()), kMeasurements.size(),
                          "one per measurement") &
        violations.Length(path.Child("counts"), static_cast<size_t>(message.counts_size()),
                          kCounts.size() + 2, "one per count"))) {
    return report;
  }
  for (size_t k = 0; k < kMeasurements.size(); ++k) {
    report.measured.*kMeasurements[k] = message.measurements(static_cast<int>(k));
  }
  for (size_t k = 0; k < kCounts.size(); ++k) {
    report.measured.*kCounts[k] = message.counts(static_cast<int>(k));
  }
  report.iterations = message.counts(static_cast<int>(kCounts.size()));
  report.iteration_cap = message.counts(static_cast<int>(kCounts.size() + 1));
  for (size_t k = 0; k < kStepWarnings.size(); ++k) {
    report.warnings.*kStepWarnings[k] = ((message.warnings() >> k) & 1) != 0;
  }
  report.converged = message.converged();
  report.is_asleep = is_asleep;
  report.impulses = CheckImpulses(path, message, owner, violations);
  return report;
}

v1::RuntimeSnapshot::Sleep ToMessage(const SleepWatch::State& state) {
  v1::RuntimeSnapshot::Sleep message;
  message.set_is_asleep(state.is_asleep);
  message.set_wants_look(state.wants_look);
  message.set_is_watching(state.is_watching);
  const size_t numbers =
      std::visit([](const auto& values) { return values.size(); }, state.begin_m);
  if (numbers > 0) FillColumn(state.begin_m, 0, numbers / 3, message.mutable_begin_m());
  message.set_steps(state.steps);
  message.set_looks(static_cast<uint32_t>(state.looks));
  message.set_patience(state.patience);
  *message.mutable_report() = ToMessage(state.report);
  return message;
}

// The column at the precision of the backend.
ScalarColumn AtPrecision(ScalarType scalar, const ScalarColumn& column) {
  return std::visit(
      [&](const auto& values) -> ScalarColumn {
        if (scalar == ScalarType::kFloat64) {
          return std::vector<double>(values.begin(), values.end());
        }
        std::vector<float> rounded;
        for (const auto value : values) rounded.push_back(static_cast<float>(value));
        return rounded;
      },
      column);
}

SleepWatch CheckSleep(const FieldPath& path, const v1::RuntimeSnapshot::Sleep& message,
                      const RuntimeOwner& owner, Violations& violations) {
  SleepWatch::State state{.is_asleep = message.is_asleep(),
                          .wants_look = message.wants_look(),
                          .is_watching = message.is_watching(),
                          .begin_m = {},
                          .steps = message.steps(),
                          .looks = message.looks(),
                          .patience = message.patience(),
                          .report = {}};
  state.report =
      CheckReport(path.Child("report"), message.report(), state.is_asleep, owner, violations);
  SleepWatch watch;
  if (message.has_begin_m()) {
    const auto rows =
        CheckPackedRows(path.Child("begin_m"), message.begin_m(),
                        {v1::PackedArray::FLOAT32, v1::PackedArray::FLOAT64}, 3, violations);
    if (!rows) return watch;
    state.begin_m = AtPrecision(owner.scalar, ToColumn(message.begin_m()));
  }
  const bool is_possible =
      SleepWatch::IsPossible(state, owner.scalar, owner.model.particle_count());
  if (violations.Require(is_possible, path, [] { return "is no watch of the cloth"; })) {
    watch.Restore(owner.on_device.settings, std::move(state));
  }
  return watch;
}

ClothProgress CheckProgress(const FieldPath& path, const v1::RuntimeSnapshot& message,
                            Violations& violations) {
  ClothProgress progress;
  progress.completed_steps = message.completed_steps();
  progress.time_s = message.time_s();
  violations.InRange(path.Child("time_s"), progress.time_s, {0, kMaxMotionStart_s, "s"});
  violations.CountInRange(path.Child("fault"), message.fault(), 0,
                          static_cast<uint64_t>(FaultReason::kInWorld));
  progress.fault = static_cast<FaultReason>(message.fault());
  if (violations.Length(path.Child("warnings"), static_cast<size_t>(message.warnings_size()),
                        kCounters.size(), "one per counter")) {
    for (size_t k = 0; k < kCounters.size(); ++k) {
      progress.warnings.*kCounters[k] = message.warnings(static_cast<int>(k));
    }
  }
  return progress;
}

ColliderTrack CheckColliderTrack(const FieldPath& path, const v1::RuntimeSnapshot& message,
                                 const RuntimeOwner& owner, Violations& violations) {
  ColliderTrack track;
  const std::vector<Collider>& colliders = owner.on_device.colliders;
  std::vector<Vector3d> pivots_m;
  for (const Collider& collider : colliders) pivots_m.push_back(CentreOf(collider));
  track.Rest(std::move(pivots_m));
  if (!message.has_colliders()) {
    violations.Require(!HasBodies(colliders), path.Child("colliders"),
                       [] { return "is missing: the cloth has a collider with a mass"; });
    return track;
  }
  auto moving = CheckTrack<RigidMotion>(path.Child("colliders"), message.colliders(),
                                        colliders.size(), false, violations);
  if (violations.Require(!moving.empty(), path.Child("colliders"),
                         [] { return "moves colliders of a cloth that has none"; })) {
    track.Restore(std::move(moving));
  }
  return track;
}

LengthTrack CheckLengths(const FieldPath& path, const v1::RuntimeSnapshot& message,
                         const RuntimeOwner& owner, Violations& violations) {
  LengthTrack track;
  if (!message.has_lengths()) return track;
  const uint32_t count = owner.model.constraint_count();
  auto lengths =
      CheckTrack<double>(path.Child("lengths"), message.lengths(), count, true, violations);
  if (violations.Require(count > 0 && lengths.size() == count, path.Child("lengths"),
                         [] { return "does not drive the constraints of the cloth"; })) {
    track.Restore(owner.model, std::move(lengths));
  }
  return track;
}

}  // namespace

void FillColumn(const ScalarColumn& column, size_t first_row, size_t rows, v1::PackedArray* array) {
  array->add_shape(static_cast<uint32_t>(rows));
  array->add_shape(3);
  std::visit(
      [&](const auto& values) {
        constexpr bool kIsDouble = sizeof(values[0]) == sizeof(double);
        array->set_data_type(kIsDouble ? v1::PackedArray::FLOAT64 : v1::PackedArray::FLOAT32);
        array->mutable_data()->assign(reinterpret_cast<const char*>(values.data() + 3 * first_row),
                                      3 * rows * sizeof(values[0]));
      },
      column);
}

ScalarColumn ToColumn(const v1::PackedArray& array) {
  const auto copy = [&](auto values) -> ScalarColumn {
    values.resize(array.data().size() / sizeof(values[0]));
    std::memcpy(values.data(), array.data().data(), array.data().size());
    return values;
  };
  if (array.data_type() == v1::PackedArray::FLOAT64) return copy(std::vector<double>());
  return copy(std::vector<float>());
}

v1::RuntimeSnapshot RuntimeMessage(const RuntimeState& state) {
  v1::RuntimeSnapshot message;
  message.set_completed_steps(state.progress.completed_steps);
  message.set_time_s(state.progress.time_s);
  message.set_fault(static_cast<uint32_t>(state.progress.fault));
  for (const auto member : kCounters) message.add_warnings(state.progress.warnings.*member);
  message.set_base_time_s(state.base_time_s);
  message.set_base_steps(state.base_steps);
  *message.mutable_pins() = ToMessage(state.pins);
  *message.mutable_grips() = ToMessage(state.grips);
  if (state.lengths.is_driven()) *message.mutable_lengths() = ToMessage(state.lengths.track());
  if (state.colliders.is_moving())
    *message.mutable_colliders() = ToMessage(state.colliders.track());
  message.set_sweep_us(state.budget.sweep_us());
  *message.mutable_sleep() = ToMessage(state.sleep.state());
  message.set_may_cross_itself(state.may_cross_itself);
  message.set_energy_gain_j(state.energy.gain_j);
  message.set_energy_scale_j(state.energy.scale_j);
  return message;
}

RuntimeState CheckRuntime(const FieldPath& path, const v1::RuntimeSnapshot& message,
                          const RuntimeOwner& owner, Violations& violations) {
  RuntimeState state;
  state.progress = CheckProgress(path, message, violations);
  const StepSettings& settings = owner.on_device.settings;
  state.time_step_s = settings.time_step_s;
  state.base_time_s = message.base_time_s();
  violations.InRange(path.Child("base_time_s"), state.base_time_s, {0, kMaxMotionStart_s, "s"});
  state.base_steps = message.base_steps();
  violations.CountInRange(path.Child("base_steps"), state.base_steps, 0,
                          state.progress.completed_steps);
  state.pins = CheckTrack<Vector3d>(path.Child("pins"), message.pins(), owner.model.pin_count(),
                                    true, violations);
  state.grips = CheckGrips(path.Child("grips"), message.grips(), owner, violations);
  state.lengths = CheckLengths(path, message, owner, violations);
  state.colliders = CheckColliderTrack(path, message, owner, violations);
  violations.InRange(path.Child("sweep_us"), message.sweep_us(), {0, kMaxMotionStart_s, "us"});
  state.budget.Restore(settings, message.sweep_us());
  state.may_cross_itself = message.may_cross_itself();
  state.energy = {message.energy_gain_j(), message.energy_scale_j()};
  violations.InRange(path.Child("energy_gain_j"), state.energy.gain_j,
                     {-kMaxEnergy_j, kMaxEnergy_j, "J"});
  violations.InRange(path.Child("energy_scale_j"), state.energy.scale_j, {0, kMaxEnergy_j, "J"});
  state.sleep = CheckSleep(path.Child("sleep"), message.sleep(), owner, violations);
  return state;
}

}  // namespace drape::api
