#include "tests/system/random_traffic.h"

#include <cmath>

#include "tests/api/requests.h"

namespace drape::test {
namespace {

constexpr uint32_t kCopies = 3;
constexpr uint32_t kLinks = 6;  // of a chain

void SetPin(v1::ClothSpec& spec, uint32_t particle) {
  spec.add_pins()->set_particle(particle);
}

}  // namespace

void RandomTraffic::DescribeSheet(v1::ClothSpec& spec) {
  const uint32_t columns = 4 + Below(4), rows = 4 + Below(4);
  particles_ = columns * rows;
  spec.mutable_grid()->set_columns(columns);
  spec.mutable_grid()->set_rows(rows);
  spec.mutable_grid()->set_width_m(Real(0.3, 0.8));
  spec.mutable_grid()->set_height_m(Real(0.3, 0.8));
  SetPin(spec, 0);
  if (Below(2) == 0) SetPin(spec, columns - 1);
  v1::Material& material = *spec.mutable_material();
  material.set_damping_per_s(Real(0, 1));
  if (Below(2) == 0) material.set_air_drag(1.2);
  if (kind() == kSprings) {
    material.set_bending_stiffness_n_per_m(Real(0, 2));
    material.set_shear_stiffness_n_per_m(Real(0, 2));
    if (Below(2) == 0) spec.mutable_settings()->set_preset(v1::StepSettings::PAPER);
  } else {
    material.set_bending_rigidity_n_m(1e-5);
    material.set_shear_modulus_n_per_m(Real(0, 5));
    if (Below(3) == 0) spec.mutable_settings()->set_preset(v1::StepSettings::ACCURATE);
  }
}

void RandomTraffic::AddColliders(v1::ClothSpec& spec) {
  spec.mutable_material()->set_friction_static(0.5);
  spec.mutable_material()->set_friction_dynamic(0.4);
  spec.mutable_material()->set_restitution(Below(2) == 0 ? 0.5 : 0);
  spec.mutable_material()->set_thickness_m(0.004);
  v1::Collider& ball = *spec.mutable_environment()->add_colliders();
  Set(ball.mutable_sphere()->mutable_center_m(), {0.2, -0.25, 0.2});
  ball.mutable_sphere()->set_radius_m(0.2);
  if (Below(2) == 0) Set(ball.mutable_velocity_m_per_s(), {0.3, 0, -0.1});
  v1::Collider& box = *spec.mutable_environment()->add_colliders();
  Set(box.mutable_box()->mutable_center_m(), {0.3, -0.6, 0.1});
  Set(box.mutable_box()->mutable_half_extents_m(), {0.6, 0.05, 0.6});
  Set(box.mutable_box()->mutable_rotation_xyzw(), {0.1, 0.2, 0.05, 1});
}

void RandomTraffic::DescribeChain(v1::ClothSpec& spec) {
  v1::Particles& particles = *spec.mutable_particles();
  for (uint32_t k = 0; k <= kLinks; ++k) {
    for (const double x : {0.1 * k, 0.0, 0.02 * (k % 2)}) particles.add_positions_m(x);
    particles.add_masses_kg(0.1 + 0.05 * k);
    if (k == 0) continue;
    v1::DistanceConstraint& link = *particles.add_distance_constraints();
    link.set_i(k - 1);
    link.set_j(k);
    if (k % 3 == 0) link.set_kind(v1::DistanceConstraint::AT_MOST);
  }
  v1::Spring& spring = *particles.add_springs();
  spring.set_j(3);
  spring.set_stiffness_n_per_m(5);
  SetPin(spec, 0);
}

void RandomTraffic::DescribeMesh(v1::ClothSpec& spec) {
  *spec.mutable_mesh() = SquareMesh();
  spec.mutable_material()->set_bending_rigidity_n_m(1e-3);
  SetPin(spec, 0);
}

v1::CreateClothsRequest RandomTraffic::Creation(const std::string& session) {
  v1::CreateClothsRequest request;
  request.set_session(session);
  request.set_count(kCopies);
  v1::ClothSpec& spec = *request.mutable_spec();
  spec.mutable_settings()->set_preset(v1::StepSettings::REALTIME);
  if (kind() == kChain) {
    DescribeChain(spec);
    particles_ = kLinks + 1;
  } else if (kind() == kMesh) {
    DescribeMesh(spec);
    particles_ = 4;
  } else {
    DescribeSheet(spec);
  }
  if (spec.settings().preset() == v1::StepSettings::REALTIME) {
    spec.mutable_settings()->set_substeps(2 + Below(6));
  }
  Set(spec.mutable_transform()->mutable_position_m(), {Real(-5, 5), Real(0, 2), Real(-5, 5)});
  if (kind() == kColliders) {
    Set(spec.mutable_transform()->mutable_position_m(), {0, 0, 0});
    AddColliders(spec);
  }
  if (kind() == kSelf && may_touch_itself_) spec.mutable_self_collision();
  if (kind() == kGrips) spec.set_max_grips(2);
  if (kind() == kSleep) {
    spec.mutable_settings()->set_sleep_motion_m(Real(0.05, 1));
    spec.mutable_settings()->set_sleep_after_s(0.1);
  }
  for (uint32_t k = 0; k < kCopies; ++k) {
    Set(request.add_overrides()->mutable_gravity_m_per_s2(), {Real(-2, 2), -9.81, Real(-2, 2)});
  }
  return request;
}

v1::StepRequest RandomTraffic::Steps(const std::string& session, const Ids& ids) {
  v1::StepRequest request = StepsOf(session, ids, 1 + Below(kind() == kSleep ? 12 : 8));
  request.set_report(true);
  request.mutable_view()->set_positions(true);
  request.mutable_view()->set_velocities(true);
  const auto place = [&](auto* list) {
    for (uint32_t axis = 0; axis < 3; ++axis) list->Add(Real(-0.3, 0.3));
  };
  for (const uint64_t id : ids) {
    const bool acts = Below(kind() == kSleep ? 6 : 2) == 0;
    if (!acts) continue;
    const double over_s = Below(2) == 0 ? 0 : Real(0, 0.2);
    if (kind() == kColliders) {
      v1::ColliderControls& table = *request.mutable_collider_controls();
      table.add_cloth_ids(id);
      table.add_colliders(Below(2));
      place(table.mutable_positions_m());
      for (const double q : {Real(-1, 1), Real(-1, 1), 0.5, 1.0}) table.add_rotations_xyzw(q);
      table.add_over_s(over_s);
    } else if (kind() == kGrips) {
      v1::GripControls& table = *request.mutable_grip_controls();
      table.add_cloth_ids(id);
      table.add_slots(Below(2));
      table.add_actions(static_cast<v1::GripControls::Action>(1 + Below(4)));
      table.add_particles(particles_ / 2 + Below(particles_ / 2));
      table.add_radii_m(10);
      place(table.mutable_targets_m());
      table.add_over_s(over_s);
      request.set_grip_states(true);
    } else if (kind() == kChain) {
      v1::RestLengthControls& table = *request.mutable_rest_length_controls();
      table.add_cloth_ids(id);
      table.add_constraints(Below(kLinks));
      table.add_lengths_m(Real(0.05, 0.15));
      table.add_over_s(over_s);
    } else {
      v1::PinControls& table = *request.mutable_pin_controls();
      table.add_cloth_ids(id);
      table.add_particles(0);
      place(table.mutable_targets_m());
      table.add_over_s(over_s);
    }
  }
  return request;
}

void RandomTraffic::Disturb(Stub& stub, const std::string& session, const Ids& ids) {
  v1::UpdateClothsRequest update;
  update.set_session(session);
  for (const uint64_t id : ids) update.add_cloth_ids(id);
  v1::ClothSpec& spec = *update.mutable_spec();
  const auto change = [&](const char* path) { update.mutable_update_mask()->add_paths(path); };
  if (Below(2) == 0) {
    change("pins");
    SetPin(spec, particles_ - 1);
  }
  if (Below(2) == 0) {
    change("environment.gravity_m_per_s2");
    Set(spec.mutable_environment()->mutable_gravity_m_per_s2(), {1, -3, 0});
  }
  if (Below(2) == 0) {
    change("environment.colliders");
    AddColliders(spec);
  }
  if (Below(2) == 0 && kind() != kChain) {
    change("material.bending_rigidity_n_m");
    spec.mutable_material()->set_bending_rigidity_n_m(2e-5);
  }
  if (Below(2) == 0) {
    change("settings");
    spec.mutable_settings()->set_time_step_s(0.01);
  }
  if (update.update_mask().paths_size() > 0) {
    const auto answer = Call(stub, &Stub::UpdateCloths, update);
    EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  }
  if (Below(2) == 0) {
    v1::ResetClothsRequest reset;
    reset.set_session(session);
    for (const uint64_t id : ids) reset.add_cloth_ids(id);
    EXPECT_TRUE(Call(stub, &Stub::ResetCloths, reset).status.ok());
  }
  Step(stub, StepsOf(session, ids, 1 + Below(20)));
}

v1::StepRequest RandomTraffic::OnlyFor(const v1::StepRequest& request, uint64_t cloth,
                                       uint64_t instead) {
  v1::StepRequest only = request;
  only.clear_cloth_ids();
  only.add_cloth_ids(instead);
  // Every table has at most one row for each cloth.
  const auto keep = [&](auto& from, auto* to, const auto& copy_row) {
    to->Clear();
    for (int r = 0; r < from.cloth_ids_size(); ++r) {
      if (from.cloth_ids(r) != cloth) continue;
      to->add_cloth_ids(instead);
      copy_row(r);
    }
  };
  const auto copy = [](const auto& from, auto* to, int row, int width) {
    for (int k = 0; k < width; ++k) to->Add(from.Get(row * width + k));
  };
  if (request.has_pin_controls()) {
    const v1::PinControls& from = request.pin_controls();
    v1::PinControls* to = only.mutable_pin_controls();
    keep(from, to, [&](int r) {
      copy(from.particles(), to->mutable_particles(), r, 1);
      copy(from.targets_m(), to->mutable_targets_m(), r, 3);
      copy(from.over_s(), to->mutable_over_s(), r, 1);
    });
  }
  if (request.has_collider_controls()) {
    const v1::ColliderControls& from = request.collider_controls();
    v1::ColliderControls* to = only.mutable_collider_controls();
    keep(from, to, [&](int r) {
      copy(from.colliders(), to->mutable_colliders(), r, 1);
      copy(from.positions_m(), to->mutable_positions_m(), r, 3);
      copy(from.rotations_xyzw(), to->mutable_rotations_xyzw(), r, 4);
      copy(from.over_s(), to->mutable_over_s(), r, 1);
    });
  }
  if (request.has_rest_length_controls()) {
    const v1::RestLengthControls& from = request.rest_length_controls();
    v1::RestLengthControls* to = only.mutable_rest_length_controls();
    keep(from, to, [&](int r) {
      copy(from.constraints(), to->mutable_constraints(), r, 1);
      copy(from.lengths_m(), to->mutable_lengths_m(), r, 1);
      copy(from.over_s(), to->mutable_over_s(), r, 1);
    });
  }
  if (request.has_grip_controls()) {
    const v1::GripControls& from = request.grip_controls();
    v1::GripControls* to = only.mutable_grip_controls();
    keep(from, to, [&](int r) {
      copy(from.slots(), to->mutable_slots(), r, 1);
      copy(from.actions(), to->mutable_actions(), r, 1);
      copy(from.particles(), to->mutable_particles(), r, 1);
      copy(from.radii_m(), to->mutable_radii_m(), r, 1);
      copy(from.targets_m(), to->mutable_targets_m(), r, 3);
      copy(from.over_s(), to->mutable_over_s(), r, 1);
    });
  }
  return only;
}

std::string AnswerText(v1::StepResponse answer) {
  answer.clear_timing();
  return answer.DebugString();
}

}  // namespace drape::test
