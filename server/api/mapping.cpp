#include "server/api/mapping.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/api/collider_message.h"
#include "server/api/geometry_message.h"
#include "server/api/settings_message.h"
#include "server/solver/load.h"

namespace drape::api {
namespace {

uint64_t NotNegative(int64_t us) {
  return static_cast<uint64_t>(std::max<int64_t>(us, 0));
}

v1::StepTiming ToProto(const StepTiming& timing) {
  v1::StepTiming message;
  message.set_queue_us(NotNegative(timing.queue_us));
  message.set_upload_us(NotNegative(timing.upload_us));
  message.set_device_us(NotNegative(timing.device_us));
  message.set_readback_us(NotNegative(timing.readback_us));
  message.set_batch_cloths(timing.batch_cloths);
  message.set_batch_requests(timing.batch_requests);
  message.set_batch_dispatches(timing.batch_dispatches);
  return message;
}

v1::MeshRepair ToProto(const MeshRepairCounts& counts) {
  v1::MeshRepair message;
  message.set_welded_vertices(counts.welded_vertices);
  message.set_collapsed_vertices(counts.collapsed_vertices);
  message.set_largest_shift_m(counts.largest_shift_m);
  message.set_flipped_edges(counts.flipped_edges);
  message.set_dropped_triangles(counts.dropped_triangles);
  message.set_turned_triangles(counts.turned_triangles);
  message.set_non_manifold_edges(counts.non_manifold_edges);
  message.set_loose_vertices(counts.loose_vertices);
  return message;
}

}  // namespace

v1::Session ToProto(const SessionView& session) {
  v1::Session message;
  message.set_name(session.name);
  message.set_ttl_s(session.ttl_s);
  message.set_remaining_s(session.remaining_s);
  message.set_cloth_count(session.cloth_count);
  message.set_particle_count(session.particle_count);
  message.set_display_name(session.display_name);
  return message;
}

v1::ClothShape ToProto(const SceneModel& model, const std::string& plan, const ClearStart* start,
                       const std::optional<ElasticLimit>& elastic_limit) {
  v1::ClothShape message;
  message.set_particles(model.described_particle_count());
  message.set_distance_constraints(model.constraint_count());
  message.set_springs(model.spring_count());
  message.set_point_joints(model.joint_count());
  message.set_elastic_elements(model.elastic_count());
  message.set_triangles(static_cast<uint32_t>(model.triangles().size()));
  message.set_colours(model.colour_count());
  message.set_pins(model.pin_count());
  message.set_dropped_triangles(model.dropped_triangles());
  message.set_dropped_constraints(model.dropped_constraints());
  if (model.mesh_repair() != MeshRepairCounts()) {
    *message.mutable_mesh_repair() = ToProto(model.mesh_repair());
  }
  const bool is_cleared = start != nullptr && start->clearance == StartClearance::kCleared;
  if (model.is_start_restored() || is_cleared) {
    v1::StartCorrection& correction = *message.mutable_start_correction();
    correction.set_described_error(model.rest_errors().max);
    correction.set_start_error(is_cleared ? start->errors.max : model.start_errors().max);
    if (is_cleared) {
      correction.set_let_out_edges(static_cast<uint32_t>(start->let_out.size()));
      correction.set_largest_let_out(start->largest_let_out);
    }
  }
  if (elastic_limit) {
    v1::ElasticLimit& limit = *message.mutable_elastic_limit();
    limit.set_elements(elastic_limit->elements);
    limit.set_least_share(elastic_limit->least_share);
    limit.set_enough_substeps(elastic_limit->enough_substeps.value_or(0));
  }
  message.set_plan(plan);
  return message;
}

v1::Environment EnvironmentToProto(const ClothParameters& parameters) {
  v1::Environment message;
  Append(parameters.gravity_m_per_s2, message.mutable_gravity_m_per_s2());
  Append(parameters.wind_m_per_s, message.mutable_wind_m_per_s());
  for (const Collider& collider : parameters.colliders) {
    *message.add_colliders() = ToProto(collider);
  }
  for (size_t k = 0; k < parameters.collider_motions.size(); ++k) {
    const RigidMotion& motion = parameters.collider_motions[k];
    v1::Collider* collider = message.mutable_colliders(static_cast<int>(k));
    if (!parameters.colliders[k].is_body()) Append(motion.pivot_m, collider->mutable_pivot_m());
    Append(motion.velocity_m_per_s, collider->mutable_velocity_m_per_s());
    Append(motion.angular_velocity_rad_per_s, collider->mutable_angular_velocity_rad_per_s());
  }
  return message;
}

v1::Cloth ToProto(const ClothRecord& record) {
  const auto description = record.description();
  const ClothProgress progress = record.runtime->progress();
  v1::Cloth message;
  message.set_id(record.id.Packed());
  *message.mutable_shape() = ToProto(*description->model, description->plan, record.start().get(),
                                     ElasticLimitOf(*description->model, description->parameters));
  message.set_step(progress.completed_steps);
  message.set_time_s(progress.time_s);
  *message.mutable_environment() = EnvironmentToProto(description->parameters);
  *message.mutable_settings() =
      ToProto(RaiseSubsteps(*description->model, description->parameters).settings);
  for (const Pin& pin : description->pins) {
    v1::Pin* pin_message = message.add_pins();
    pin_message->set_particle(description->model->DescribedOf(pin.particle));
    if (pin.target_m) Append(*pin.target_m, pin_message->mutable_target_m());
  }
  Append(record.placement.environment_origin_m, message.mutable_environment_origin_m());
  message.set_max_grips(description->parameters.max_grips);
  message.set_world(record.world);
  message.set_faulted(progress.fault != FaultReason::kNone);
  message.set_fault_reason(std::string(FaultReasonText(progress.fault)));
  for (const RigidMotion& motion : ColliderMotionsNow(record)) {
    *message.add_collider_poses() = ToProto(RigidTransform{motion.position_m, motion.rotation});
  }
  return message;
}

v1::StepReport ToProto(ClothId id, uint64_t step, const StepReport& report,
                       const WarningCounters& warnings) {
  v1::StepReport message;
  const Measurements& measured = report.measured;
  message.set_cloth_id(id.Packed());
  message.set_step(step);
  message.set_max_strain(measured.max_strain);
  message.set_rms_strain(measured.rms_strain);
  message.set_strain_p50(measured.strain_p50);
  message.set_strain_p90(measured.strain_p90);
  message.set_strain_p99(measured.strain_p99);
  message.set_rms_motion_m(measured.rms_motion_m);
  message.set_kinetic_energy_j(measured.kinetic_energy_j);
  message.set_potential_energy_j(measured.potential_energy_j);
  message.set_strain_energy_j(measured.strain_energy_j);
  message.set_lowest_m(measured.lowest_m);
  message.set_contacts(measured.contacts);
  message.set_max_penetration_m(measured.max_penetration_m);
  message.set_iterations(report.iterations);
  message.set_iteration_cap(report.iteration_cap);
  message.set_asleep(report.is_asleep);
  message.set_max_residual_m(measured.max_residual_m);
  if (std::isfinite(measured.smallest_distance_m)) {
    message.set_smallest_distance_m(measured.smallest_distance_m);
  }
  message.set_near_pairs(measured.near_pairs);
  message.set_crossings(measured.crossings);
  message.set_converged(report.converged);
  message.set_faulted(report.fault != FaultReason::kNone);
  message.set_fault_reason(std::string(FaultReasonText(report.fault)));
  const auto add_warning = [&](const char* name, uint64_t count) {
    if (count > 0) (*message.mutable_warnings())[name] = count;
  };
  add_warning("tolerance_raised", warnings.tolerance_raised);
  add_warning("not_converged", warnings.not_converged);
  add_warning("springs_beyond_limit", warnings.springs_beyond_limit);
  add_warning("elastic_beyond_limit", warnings.elastic_beyond_limit);
  add_warning("springs_gain_energy", warnings.springs_gain_energy);
  add_warning("energy_gained", warnings.energy_gained);
  add_warning("over_budget", warnings.over_budget);
  add_warning("strain_beyond_limit", warnings.strain_beyond_limit);
  add_warning("starts_crossing", warnings.starts_crossing);
  add_warning("contacts_given_up", warnings.contacts_given_up);
  return message;
}

namespace {

// Zero where it is not known.
Eigen::Vector3d ImpulseOnGrip(const StepImpulses* impulses, const GripState& grip) {
  if (impulses == nullptr || !grip.particle) return Eigen::Vector3d::Zero();
  const auto& particles = impulses->gripped_particles;
  const auto found = std::ranges::find(particles, *grip.particle);
  if (found == particles.end()) return Eigen::Vector3d::Zero();
  return impulses->grips_n_s[static_cast<size_t>(found - particles.begin())];
}

void AddGrips(const ClothRecord& cloth, const ClothOutcome& outcome, bool has_impulses,
              v1::GripStates& message) {
  const std::vector<GripState>& grips = outcome.grips;
  const auto description = cloth.description();
  for (uint32_t slot = 0; slot < grips.size(); ++slot) {
    const GripState& grip = grips[slot];
    message.add_cloth_ids(cloth.id.Packed());
    message.add_slots(slot);
    message.add_particles(
        grip.particle ? static_cast<int32_t>(description->model->DescribedOf(*grip.particle)) : -1);
    Append(grip.particle ? cloth.placement.EnvironmentFromCloth(grip.position_m)
                         : Eigen::Vector3d(0, 0, 0),
           message.mutable_positions_m());
    if (has_impulses) {
      Append(ImpulseOnGrip(outcome.impulses.get(), grip), message.mutable_impulses_n_s());
    }
  }
}

void AddBodies(const ClothRecord& cloth, const std::vector<BodyState>& bodies,
               v1::StepReport& message) {
  for (const BodyState& body : bodies) {
    v1::BodyState& state = *message.add_bodies();
    state.set_collider(body.collider);
    Append(cloth.placement.WorldFromCloth(body.motion.position_m), state.mutable_position_m());
    Append(body.motion.rotation, state.mutable_rotation_xyzw());
    Append(body.motion.velocity_m_per_s, state.mutable_velocity_m_per_s());
    Append(body.motion.angular_velocity_rad_per_s, state.mutable_angular_velocity_rad_per_s());
  }
}

void AddImpulses(ClothId id, const StepImpulses& impulses, const SceneModel& model,
                 v1::StepResponse& message) {
  v1::ColliderImpulses& colliders = *message.mutable_collider_impulses();
  for (uint32_t c = 0; c < impulses.colliders.size(); ++c) {
    colliders.add_cloth_ids(id.Packed());
    colliders.add_colliders(c);
    Append(impulses.colliders[c].impulse_n_s, colliders.mutable_impulses_n_s());
    Append(impulses.colliders[c].angular_impulse_n_m_s, colliders.mutable_angular_impulses_n_m_s());
  }
  v1::PinImpulses& pins = *message.mutable_pin_impulses();
  DRAPE_CHECK(model.pin_count() == impulses.pins_n_s.size(), "an impulse of every pin");
  for (size_t k = 0; k < impulses.pins_n_s.size(); ++k) {
    pins.add_cloth_ids(id.Packed());
    pins.add_particles(model.DescribedOf(model.pins()[k]));
    Append(impulses.pins_n_s[k], pins.mutable_impulses_n_s());
  }
}

void AddContacts(ClothId id, std::span<const ParticleImpulse> contacts, const SceneModel& model,
                 v1::ContactImpulses& message) {
  for (const ParticleImpulse& contact : contacts) {
    const bool is_cloth = contact.collider == ParticleImpulse::kCloth;
    message.add_cloth_ids(id.Packed());
    message.add_particles(model.DescribedOf(contact.particle));
    message.add_colliders(is_cloth ? -1 : static_cast<int32_t>(contact.collider));
    Append(contact.impulse_n_s, message.mutable_impulses_n_s());
  }
}

}  // namespace

v1::StepResponse ToProto(const ClothList& cloths, const StepOutcome& outcome) {
  DRAPE_CHECK(cloths.size() == outcome.cloths.size(), "one outcome per cloth");
  v1::StepResponse message;
  if (outcome.has_contacts) message.mutable_contact_impulses();
  for (size_t k = 0; k < cloths.size(); ++k) {
    const ClothOutcome& cloth = outcome.cloths[k];
    const ClothId id = cloths[k]->id;
    message.add_cloth_ids(id.Packed());
    message.add_steps(cloth.stamp.completed_steps);
    if (cloth.report) {
      *message.add_reports() =
          ToProto(id, cloth.stamp.completed_steps, *cloth.report, cloth.warnings);
      if (cloth.report->bodies != nullptr) {
        AddBodies(*cloths[k], *cloth.report->bodies, *message.mutable_reports()->rbegin());
      }
    }
    if (cloth.stamp.fault != FaultReason::kNone) message.add_faulted_cloth_ids(id.Packed());
    if (!cloth.grips.empty()) {
      AddGrips(*cloths[k], cloth, outcome.has_impulses, *message.mutable_grips());
    }
    if (cloth.impulses == nullptr) continue;
    if (outcome.has_impulses) AddImpulses(id, *cloth.impulses, *cloth.model, message);
    if (outcome.has_contacts && cloth.impulses->contacts) {
      AddContacts(id, *cloth.impulses->contacts, *cloth.model, *message.mutable_contact_impulses());
    }
  }
  *message.mutable_timing() = ToProto(outcome.timing);
  return message;
}

v1::Camera ToProto(const render::Camera& camera) {
  v1::Camera message;
  Append(camera.eye_m, message.mutable_eye_m());
  Append(camera.target_m, message.mutable_target_m());
  Append(camera.up, message.mutable_up());
  message.set_vertical_field_of_view_rad(camera.vertical_field_of_view_rad);
  return message;
}

v1::RenderResponse ToProto(const ClothList& cloths, render::DrawnPicture picture) {
  DRAPE_CHECK(cloths.size() == picture.steps.size(), "steps of every cloth");
  v1::RenderResponse message;
  message.set_png(std::move(picture.png));
  message.set_rgb(std::move(picture.rgb));
  message.set_depths_m(picture.depths_m.data(), picture.depths_m.size() * sizeof(float));
  *message.mutable_camera() = ToProto(picture.camera);
  if (!picture.bounds_m.isEmpty()) {
    Append(picture.bounds_m.min(), message.mutable_bounds_m());
    Append(picture.bounds_m.max(), message.mutable_bounds_m());
  }
  if (picture.range.low < picture.range.high) {
    message.add_range(picture.range.low);
    message.add_range(picture.range.high);
  }
  message.set_device(picture.device);
  for (const auto& cloth : cloths) message.add_cloth_ids(cloth->id.Packed());
  message.mutable_steps()->Assign(picture.steps.begin(), picture.steps.end());
  return message;
}

}  // namespace drape::api
