#include "server/solver/gl_compute/cloth_words.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>
#include <vector>

#include "server/core/check.h"
#include "server/solver/gl_compute/packing.h"
#include "server/solver/gl_compute/self_contact_words.h"
#include "shaders/interface/bindings.h"

namespace drape {

void ClothWords::WriteTargets(const GlCloth& cloth, std::span<const uint32_t> words) {
  DRAPE_CHECK(words.size() == 3 * size_t{cloth.pin_count()}, "one target per pin");
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.pin_targets, words);
}

void ClothWords::OpenGrips(GlCloth& cloth) {
  const uint32_t count = cloth.parameters.max_grips;
  cloth.grip_words.assign(count, DRAPE_NO_PARTICLE);
  cloth.grip_target_words.assign(3 * size_t{count}, 0);
  if (count == 0) return;
  const SceneModel& model = *cloth.model->model;
  std::vector<uint32_t> words(model.pins().begin(), model.pins().end());
  words.insert(words.end(), cloth.grip_words.begin(), cloth.grip_words.end());
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.held, words);
  words.clear();
  for (const double w : model.inverse_masses_per_kg()) words.push_back(FloatWord(w));
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.inverse_masses, words);
}

void ClothWords::WriteInverseMass(const GlCloth& cloth, uint32_t particle,
                                  double inverse_mass_per_kg) {
  const uint32_t word = FloatWord(inverse_mass_per_kg);
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.inverse_masses + particle, {&word, 1});
}

void ClothWords::WriteGrips(GlCloth& cloth, std::span<const Grip> grips) {
  const size_t count = cloth.parameters.max_grips;
  DRAPE_CHECK(grips.size() <= count, "no more grips than max_grips");
  if (count == 0) return;
  const std::span<const double> w = cloth.model->model->inverse_masses_per_kg();
  std::vector<uint32_t> held(count, DRAPE_NO_PARTICLE);
  std::ranges::transform(grips, held.begin(), &Grip::particle);
  if (held != cloth.grip_words) {
    for (const uint32_t i : cloth.grip_words) {
      if (i != DRAPE_NO_PARTICLE) WriteInverseMass(cloth, i, w[i]);
    }
    for (const Grip& grip : grips) {
      DRAPE_CHECK(w[grip.particle] != 0, "a grip holds what is no pin");
      WriteInverseMass(cloth, grip.particle, 0);
    }
    arena_.Write(cloth.parameter_words, cloth.parameter_layout.held + cloth.pin_count(), held);
    cloth.grip_words = std::move(held);
  }
  std::vector<Eigen::Vector3d> targets_m(count, Eigen::Vector3d::Zero());
  std::ranges::transform(grips, targets_m.begin(), &Grip::target_m);
  std::vector<uint32_t> targets = PackTargets(targets_m);
  if (targets == cloth.grip_target_words) return;
  cloth.grip_target_words = std::move(targets);
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.pin_targets + 3 * cloth.pin_count(),
               cloth.grip_target_words);
}

void ClothWords::WriteColliders(const GlCloth& cloth) {
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.colliders,
               PackColliders(cloth.parameters.colliders, cloth.maps));
}

void ClothWords::WriteElastic(const GlCloth& cloth) {
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.hinge_stages,
               PackHingeStages(cloth.plan.solver.hinge_stages));
  if (!cloth.plan.Has(StepStage::kSolveElastic)) return;
  arena_.Write(
      cloth.parameter_words, cloth.parameter_layout.elastic_entries,
      PackElasticEntries(*cloth.model->model, cloth.plan.schedule.largest_force_interval_s2()));
}

void ClothWords::WriteSelfContacts(const GlCloth& cloth) {
  if (!cloth.touches_itself()) return;
  const auto words =
      std::bit_cast<std::array<uint32_t, kSelfContactRecordWords>>(MakeSelfContactRecord(cloth));
  arena_.Write(cloth.contact_words, 0, words);
  if (cloth.crossing_flags.empty()) return;
  arena_.Write(cloth.contact_words, kSelfContactRecordWords, cloth.crossing_flags);
}

void ClothWords::WriteImpulses(const GlCloth& cloth) {
  if (!cloth.impulses.is_made()) return;
  arena_.Write(cloth.impulses.words, 0, PackImpulses(cloth));
}

void ClothWords::WriteLengths(const GlCloth& cloth, std::span<const uint32_t> starts) {
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.length_starts, starts);
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.length_targets, cloth.length_words);
}

void ClothWords::SetLengthTargets(GlCloth& cloth, std::span<const double> rest_lengths_m) {
  const bool has_targets = !rest_lengths_m.empty();
  if (!has_targets && !cloth.are_lengths_moving) return;
  DRAPE_CHECK(cloth.has_own_lengths(), "only a cloth with rest lengths of its own is driven");
  const std::vector<uint32_t> starts = cloth.length_words;
  if (has_targets) cloth.length_words = PackLengths(rest_lengths_m);
  DRAPE_CHECK(cloth.length_words.size() == starts.size(), "one rest length per constraint");
  WriteLengths(cloth, starts);
  cloth.are_lengths_moving = has_targets;
}

void ClothWords::WriteMotions(GlCloth& cloth, std::span<const RigidMotion> motions) {
  if (motions.empty()) return;
  const ClothParameters& parameters = cloth.parameters;
  DRAPE_CHECK(motions.size() == parameters.colliders.size(), "one motion per collider");
  std::vector<uint32_t> words = PackMotions(motions, parameters.settings.substep_s());
  if (words == cloth.motion_words) return;
  cloth.motion_words = std::move(words);
  arena_.Write(cloth.parameter_words, cloth.parameter_layout.collider_motions, cloth.motion_words);
}

void ClothWords::EndMotions(GlCloth& cloth) {
  std::vector<RigidMotion>& motions = cloth.parameters.collider_motions;
  if (cloth.fault == FaultReason::kNone) {
    const double step_s = cloth.parameters.settings.time_step_s;
    for (RigidMotion& motion : motions) motion = motion.After(step_s);
    return;
  }
  // A faulted cloth is measured in its last good state.
  std::vector<RigidMotion> stopped = motions;
  for (RigidMotion& motion : stopped) {
    motion.velocity_m_per_s.setZero();
    motion.angular_velocity_rad_per_s.setZero();
  }
  WriteMotions(cloth, stopped);
}

}  // namespace drape
