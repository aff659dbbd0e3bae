// Good requests for tests to spoil.
#pragma once

#include <cstring>
#include <initializer_list>
#include <vector>

#include "drape/v1/cloths.pb.h"
#include "drape/v1/render.pb.h"
#include "drape/v1/step.pb.h"

namespace drape::test {

template <class T>
v1::PackedArray Packed(v1::PackedArray::DataType type, uint32_t columns,
                       const std::vector<T>& values) {
  v1::PackedArray array;
  array.set_data_type(type);
  array.add_shape(static_cast<uint32_t>(values.size() / columns));
  array.add_shape(columns);
  array.set_data(values.data(), values.size() * sizeof(T));
  return array;
}

inline void Set(google::protobuf::RepeatedField<double>* list,
                std::initializer_list<double> values) {
  list->Assign(values.begin(), values.end());
}
inline void Set(google::protobuf::RepeatedField<uint32_t>* list,
                std::initializer_list<uint32_t> values) {
  list->Assign(values.begin(), values.end());
}

// Two triangles, one unit square.
inline v1::Mesh SquareMesh() {
  v1::Mesh mesh;
  *mesh.mutable_positions_m() =
      Packed<float>(v1::PackedArray::FLOAT32, 3, {0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1});
  *mesh.mutable_triangles() = Packed<uint32_t>(v1::PackedArray::UINT32, 3, {0, 2, 1, 0, 3, 2});
  return mesh;
}

// A closed tetrahedron.
inline v1::Mesh SolidMesh() {
  v1::Mesh mesh;
  *mesh.mutable_positions_m() =
      Packed<float>(v1::PackedArray::FLOAT32, 3, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  *mesh.mutable_triangles() =
      Packed<uint32_t>(v1::PackedArray::UINT32, 3, {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
  return mesh;
}

// Three particles in a row, two constraints, one spring.
inline v1::Particles ShortChain() {
  v1::Particles particles;
  Set(particles.mutable_positions_m(), {0, 0, 0, 1, 0, 0, 2, 0, 0});
  Set(particles.mutable_masses_kg(), {1, 1, 1});
  for (uint32_t k = 0; k < 2; ++k) {
    v1::DistanceConstraint* constraint = particles.add_distance_constraints();
    constraint->set_i(k);
    constraint->set_j(k + 1);
  }
  v1::Spring* spring = particles.add_springs();
  spring->set_i(0);
  spring->set_j(2);
  spring->set_stiffness_n_per_m(5);
  return particles;
}

// Two copies of a 4 x 3 grid, pinned at one corner, with every possible field set.
inline v1::CreateClothsRequest GoodCreation() {
  v1::CreateClothsRequest request;
  request.set_session("sessions/none");
  request.set_count(2);
  v1::ClothSpec* spec = request.mutable_spec();
  v1::Grid* grid = spec->mutable_grid();
  grid->set_columns(4);
  grid->set_rows(3);
  grid->set_width_m(0.3);
  grid->set_height_m(0.2);
  spec->add_pins()->set_particle(0);
  v1::Pin* moved = spec->add_pins();
  moved->set_particle(3);
  Set(moved->mutable_target_m(), {0.3, 0.1, 0});
  Set(spec->mutable_transform()->mutable_position_m(), {0, 1, 0});
  Set(spec->mutable_transform()->mutable_rotation_xyzw(), {0, 0, 0, 2});
  spec->mutable_material()->set_friction_static(0.5);
  spec->mutable_material()->set_friction_dynamic(0.4);
  v1::Environment* environment = spec->mutable_environment();
  Set(environment->mutable_gravity_m_per_s2(), {0, -9, 0});
  Set(environment->mutable_wind_m_per_s(), {2, 0, 1});
  spec->mutable_material()->set_air_drag(1.2);
  spec->mutable_material()->set_air_lift(0.8);
  v1::Sphere* sphere = environment->add_colliders()->mutable_sphere();
  Set(sphere->mutable_center_m(), {0, -1, 0});
  sphere->set_radius_m(0.5);
  v1::Plane* plane = environment->add_colliders()->mutable_plane();
  Set(plane->mutable_point_m(), {0, -2, 0});
  Set(plane->mutable_normal(), {0, 3, 0});
  v1::Capsule* capsule = environment->add_colliders()->mutable_capsule();
  Set(capsule->mutable_a_m(), {-1, -1, 0});
  Set(capsule->mutable_b_m(), {1, -1, 0.5});
  capsule->set_radius_m(0.25);
  v1::Box* box = environment->add_colliders()->mutable_box();
  Set(box->mutable_center_m(), {2, -1, 0});
  Set(box->mutable_half_extents_m(), {0.5, 0.25, 1});
  Set(box->mutable_rotation_xyzw(), {0, 3, 0, 4});
  v1::Collider* moving = environment->mutable_colliders(3);
  Set(moving->mutable_velocity_m_per_s(), {0.5, 0, 0});
  Set(moving->mutable_angular_velocity_rad_per_s(), {0, 2, 0});
  Set(moving->mutable_pivot_m(), {2, 0, 0});
  spec->mutable_settings()->set_preset(v1::StepSettings::ACCURATE);
  spec->mutable_settings()->set_substeps(7);
  Set(request.mutable_environment_origins_m(), {0, 0, 0, 10, 0, 0});
  Set(request.mutable_transforms(), {0, 0, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1, 0, 1});
  request.add_overrides();
  v1::ClothOverride* second = request.add_overrides();
  Set(second->mutable_gravity_m_per_s2(), {0, -1, 0});
  second->mutable_settings()->set_max_iterations(3);
  second->set_damping_per_s(0.25);
  Set(second->mutable_wind_m_per_s(), {0, 0, 7});
  return request;
}

// Parts of a good creation.
inline v1::ClothSpec& Spec(v1::CreateClothsRequest& request) {
  return *request.mutable_spec();
}
// Without the parts that depend on the grid's particles.
inline v1::ClothSpec& BareSpec(v1::CreateClothsRequest& request) {
  request.mutable_spec()->clear_pins();
  return *request.mutable_spec();
}
inline v1::Mesh& Mesh(v1::CreateClothsRequest& request) {
  *BareSpec(request).mutable_mesh() = SquareMesh();
  return *Spec(request).mutable_mesh();
}
inline v1::Particles& Chain(v1::CreateClothsRequest& request) {
  *BareSpec(request).mutable_particles() = ShortChain();
  return *Spec(request).mutable_particles();
}
inline v1::Sphere& Sphere(v1::CreateClothsRequest& request) {
  return *Spec(request).mutable_environment()->mutable_colliders(0)->mutable_sphere();
}
inline v1::Plane& Plane(v1::CreateClothsRequest& request) {
  return *Spec(request).mutable_environment()->mutable_colliders(1)->mutable_plane();
}
inline v1::Capsule& Capsule(v1::CreateClothsRequest& request) {
  return *Spec(request).mutable_environment()->mutable_colliders(2)->mutable_capsule();
}
inline v1::Box& Box(v1::CreateClothsRequest& request) {
  return *Spec(request).mutable_environment()->mutable_colliders(3)->mutable_box();
}

// A mesh collider behind the others.
inline v1::Collider& AddSolid(v1::CreateClothsRequest& request) {
  v1::Collider& solid = *Spec(request).mutable_environment()->add_colliders();
  *solid.mutable_mesh() = SolidMesh();
  Set(solid.mutable_transform()->mutable_position_m(), {-4, -1, 0});
  Set(solid.mutable_transform()->mutable_rotation_xyzw(), {0, 0, 2, 0});
  return solid;
}

inline v1::StepRequest GoodStep() {
  v1::StepRequest request;
  request.set_session("sessions/none");
  request.add_cloth_ids(1);
  request.set_steps(2);
  v1::PinControls* controls = request.mutable_pin_controls();
  controls->add_cloth_ids(1);
  controls->add_particles(0);
  Set(controls->mutable_targets_m(), {0, 1, 0});
  controls->add_over_s(0.5);
  v1::ColliderControls* colliders = request.mutable_collider_controls();
  colliders->add_cloth_ids(1);
  colliders->add_colliders(2);
  Set(colliders->mutable_positions_m(), {0, 1, 2});
  Set(colliders->mutable_rotations_xyzw(), {0, 0, 2, 0});
  colliders->add_over_s(0.75);
  v1::RestLengthControls* lengths = request.mutable_rest_length_controls();
  lengths->add_cloth_ids(1);
  lengths->add_constraints(0);
  lengths->add_lengths_m(0.5);
  lengths->add_over_s(0.25);
  v1::RestLengthScales* scales = request.mutable_rest_length_scales();
  scales->add_cloth_ids(1);
  scales->add_scales(2);
  v1::GripControls* grips = request.mutable_grip_controls();
  for (const auto action : {v1::GripControls::GRAB_PARTICLE, v1::GripControls::GRAB_NEAREST,
                            v1::GripControls::HOLD, v1::GripControls::RELEASE}) {
    grips->add_cloth_ids(1);
    grips->add_slots(static_cast<uint32_t>(grips->slots_size()));
    grips->add_actions(action);
    grips->add_particles(7);
    grips->add_radii_m(0.25);
    for (const double x : {0.5, 1.0, 1.5}) grips->add_targets_m(x);
    grips->add_over_s(0.125);
  }
  v1::StepResets* resets = request.mutable_resets();
  resets->add_cloth_ids(1);
  Set(resets->mutable_transforms(), {0, 1, 0, 0, 0, 2, 0});
  Set(resets->add_overrides()->mutable_gravity_m_per_s2(), {0, -5, 0});
  resets->mutable_overrides(0)->set_restitution(0.5);
  v1::StepLoads* loads = request.mutable_loads();
  loads->set_name("start");
  loads->add_cloth_ids(2);
  loads->add_saved_cloth_ids(3);
  v1::StateView* view = request.mutable_view();
  view->set_positions(true);
  view->add_particles(0);
  view->add_particles(3);
  return request;
}

// With every compatible field set.
inline v1::RenderRequest GoodPicture() {
  v1::RenderRequest request;
  request.set_session("sessions/none");
  request.set_all_cloths(true);
  request.set_width_px(200);
  request.set_height_px(100);
  v1::Camera* camera = request.mutable_camera();
  Set(camera->mutable_eye_m(), {1, 1, 3});
  Set(camera->mutable_target_m(), {1, 0.5, 0});
  Set(camera->mutable_up(), {4, 0, 0});
  camera->set_vertical_field_of_view_rad(0.5);
  request.set_colouring(v1::RenderRequest::STRAIN);
  Set(request.mutable_range(), {-0.1, 0.2});
  request.set_hide_legend(true);
  request.set_hide_colliders(true);
  request.set_hide_pins(true);
  request.set_hide_shadows(true);
  request.set_samples(1);
  return request;
}

}  // namespace drape::test
