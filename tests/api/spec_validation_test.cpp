#include "server/api/spec_validation.h"

#include "server/api/collider_message.h"
#include "server/api/request_validation.h"
#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using test::BadCase;
using test::BareSpec;
using test::Box;
using test::Capsule;
using test::Chain;
using test::ExpectViolation;
using test::GoodCreation;
using test::kInfinity;
using test::kNaN;
using test::Mesh;
using test::NameOf;
using test::Plane;
using test::Set;
using test::Spec;
using test::Sphere;

// A leg of a table, added to the colliders of a good creation.
v1::Cylinder& Cylinder(v1::CreateClothsRequest& request) {
  auto* environment = Spec(request).mutable_environment();
  v1::Cylinder& cylinder = *environment->add_colliders()->mutable_cylinder();
  Set(cylinder.mutable_a_m(), {0, -2, 0});
  Set(cylinder.mutable_b_m(), {0, -1, 0});
  cylinder.set_radius_m(0.25);
  return cylinder;
}

using BadCreation = BadCase<v1::CreateClothsRequest>;
class SpecValidation : public testing::TestWithParam<BadCreation> {};

TEST_P(SpecValidation, NamesFieldValueAndRange) {
  v1::CreateClothsRequest request = GoodCreation();
  ASSERT_TRUE(CheckCreateCloths(request, {}).ok());
  GetParam().spoil(request);
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_FALSE(checked.ok());
  ExpectViolation(checked.status(), GetParam().field, GetParam().text);
  EXPECT_EQ(checked.status().violations().size(), 1u) << checked.status().ToString();
}

INSTANTIATE_TEST_SUITE_P(
    Topology, SpecValidation,
    testing::Values(
        BadCreation{"None", [](auto& r) { BareSpec(r).clear_topology(); }, "spec", "grid, mesh"},
        BadCreation{"NoColumns", [](auto& r) { BareSpec(r).mutable_grid()->set_columns(0); },
                    "spec.grid.columns", "0"},
        BadCreation{"NoRows", [](auto& r) { BareSpec(r).mutable_grid()->set_rows(0); },
                    "spec.grid.rows", "0"},
        BadCreation{"BillionParticles",
                    [](auto& r) {
                      BareSpec(r).mutable_grid()->set_columns(1000000);
                      Spec(r).mutable_grid()->set_rows(1000);
                    },
                    "spec.grid.columns", "1000000000"},
        BadCreation{"ProductBeyond64Bits",
                    [](auto& r) {
                      BareSpec(r).mutable_grid()->set_columns(4294967295u);
                      Spec(r).mutable_grid()->set_rows(4294967295u);
                    },
                    "spec.grid.columns", "at most"},
        BadCreation{"RepairOfAGrid",
                    [](auto& r) { Spec(r).mutable_mesh_import()->set_as_drawn(true); },
                    "spec.mesh_import.as_drawn", "true belongs to cloths made of a mesh"},
        BadCreation{"LengthsOfAGrid",
                    [](auto& r) { Spec(r).mutable_mesh_import()->set_keep_lengths(true); },
                    "spec.mesh_import.keep_lengths", "must be false"},
        BadCreation{"ManyGrips", [](auto& r) { Spec(r).set_max_grips(17); }, "spec.max_grips",
                    "17 is not in [0, 16]"},
        BadCreation{"NoWidth", [](auto& r) { Spec(r).mutable_grid()->set_width_m(0); },
                    "spec.grid.width_m", "0"},
        BadCreation{"NotANumberHeight", [](auto& r) { Spec(r).mutable_grid()->set_height_m(kNaN); },
                    "spec.grid.height_m", "nan"},
        BadCreation{"NoDensity",
                    [](auto& r) { Spec(r).mutable_material()->set_areal_density_kg_per_m2(0); },
                    "spec.material.areal_density_kg_per_m2", "0"},
        BadCreation{"MeshWithoutTriangles",
                    [](auto& r) {
                      *Mesh(r).mutable_triangles() =
                          test::Packed<uint32_t>(v1::PackedArray::UINT32, 3, {});
                    },
                    "spec.mesh.triangles", "at least 1"},
        BadCreation{"MeshWithoutPositions", [](auto& r) { Mesh(r).clear_positions_m(); },
                    "spec.mesh.positions_m.data_type", "FLOAT32 or FLOAT64"},
        BadCreation{
            "TrianglesAsFloats",
            [](auto& r) { Mesh(r).mutable_triangles()->set_data_type(v1::PackedArray::FLOAT32); },
            "spec.mesh.triangles.data_type", "UINT32"},
        BadCreation{"UnknownDataType",
                    [](auto& r) {
                      Mesh(r).mutable_positions_m()->set_data_type(
                          static_cast<v1::PackedArray::DataType>(99));
                    },
                    "spec.mesh.positions_m.data_type", "99"},
        BadCreation{"FlatShape",
                    [](auto& r) {
                      v1::PackedArray& positions = *Mesh(r).mutable_positions_m();
                      positions.clear_shape();
                      positions.add_shape(12);
                    },
                    "spec.mesh.positions_m.shape", "[12] is not [n, 3]"},
        BadCreation{"ShortBytes",
                    [](auto& r) { Mesh(r).mutable_positions_m()->mutable_data()->pop_back(); },
                    "spec.mesh.positions_m.data", "has 47 bytes, needs 48"},
        BadCreation{"HugeShape",
                    [](auto& r) { Mesh(r).mutable_positions_m()->set_shape(0, 4294967295u); },
                    "spec.mesh.positions_m.data", "needs 51539607540"},
        BadCreation{"WrongVertex",
                    [](auto& r) {
                      *Mesh(r).mutable_triangles() =
                          test::Packed<uint32_t>(v1::PackedArray::UINT32, 3, {0, 1, 4, 0, 3, 2});
                    },
                    "spec.mesh.triangles[0]", "4"},
        BadCreation{"NotANumberVertex",
                    [](auto& r) {
                      *Mesh(r).mutable_positions_m() = test::Packed<double>(
                          v1::PackedArray::FLOAT64, 3, {0, 0, 0, 1, 0, 0, 1, kNaN, 1, 0, 0, 1});
                    },
                    "spec.mesh.positions_m[2]", "nan"},
        BadCreation{"ShortPositions", [](auto& r) { Chain(r).mutable_positions_m()->RemoveLast(); },
                    "spec.particles.positions_m", "has 8 elements"},
        BadCreation{"ShortMasses", [](auto& r) { Chain(r).mutable_masses_kg()->RemoveLast(); },
                    "spec.particles.masses_kg", "2 masses for 3 particles"},
        BadCreation{"InfiniteMass", [](auto& r) { Chain(r).set_masses_kg(1, kInfinity); },
                    "spec.particles.masses_kg[1]", "inf"},
        BadCreation{"NegativeMass", [](auto& r) { Chain(r).set_masses_kg(2, -1); },
                    "spec.particles.masses_kg[2]", "-1"},
        BadCreation{"WrongConstraintIndex",
                    [](auto& r) { Chain(r).mutable_distance_constraints(1)->set_j(3); },
                    "spec.particles.distance_constraints[1].j", "3 is not in [0, 2]"},
        BadCreation{"ConstraintToItself",
                    [](auto& r) { Chain(r).mutable_distance_constraints(0)->set_j(0); },
                    "spec.particles.distance_constraints[0].j", "0"},
        BadCreation{"NoRestLength",
                    [](auto& r) { Chain(r).mutable_distance_constraints(0)->set_rest_length_m(0); },
                    "spec.particles.distance_constraints[0].rest_length_m", "0"},
        BadCreation{"UnknownKind",
                    [](auto& r) {
                      Chain(r).mutable_distance_constraints(1)->set_kind(
                          static_cast<v1::DistanceConstraint::Kind>(4));
                    },
                    "spec.particles.distance_constraints[1].kind", "EQUAL, AT_MOST, AT_LEAST"},
        BadCreation{"JointToItself", [](auto& r) { Chain(r).add_point_joints(); },
                    "spec.particles.point_joints[0].j", "equals i"},
        BadCreation{"ParticlesCoincide", [](auto& r) { Chain(r).set_positions_m(3, 0); },
                    "spec.particles.distance_constraints[0]", "coincide"},
        BadCreation{"NegativeStiffness",
                    [](auto& r) { Chain(r).mutable_springs(0)->set_stiffness_n_per_m(-5); },
                    "spec.particles.springs[0].stiffness_n_per_m", "-5"}),
    NameOf());

INSTANTIATE_TEST_SUITE_P(
    Surroundings, SpecValidation,
    testing::Values(
        BadCreation{"WrongPin", [](auto& r) { Spec(r).mutable_pins(0)->set_particle(12); },
                    "spec.pins[0].particle", "12 is not in [0, 11]"},
        BadCreation{"PinTwice", [](auto& r) { Spec(r).mutable_pins(1)->set_particle(0); },
                    "spec.pins[1].particle", "pinned already"},
        BadCreation{"ShortPinTarget",
                    [](auto& r) { Spec(r).mutable_pins(1)->mutable_target_m()->RemoveLast(); },
                    "spec.pins[1].target_m", "has 2 elements, needs 3"},
        BadCreation{"FarPinTarget", [](auto& r) { Spec(r).mutable_pins(1)->set_target_m(1, -2e6); },
                    "spec.pins[1].target_m[1]", "-2e+06"},
        BadCreation{"ShortGravity",
                    [](auto& r) {
                      Spec(r).mutable_environment()->mutable_gravity_m_per_s2()->RemoveLast();
                    },
                    "spec.environment.gravity_m_per_s2", "has 2 elements, needs 3"},
        BadCreation{
            "InfiniteGravity",
            [](auto& r) { Spec(r).mutable_environment()->set_gravity_m_per_s2(1, -kInfinity); },
            "spec.environment.gravity_m_per_s2[1]", "-inf"},
        BadCreation{"StrongWind",
                    [](auto& r) { Spec(r).mutable_environment()->set_wind_m_per_s(0, 2e4); },
                    "spec.environment.wind_m_per_s[0]", "20000 is not in [-10000, 10000] m/s"},
        BadCreation{"NegativeDrag", [](auto& r) { Spec(r).mutable_material()->set_air_drag(-1); },
                    "spec.material.air_drag", "-1 is not in [0, 1000]"},
        BadCreation{"NotANumberLift",
                    [](auto& r) { Spec(r).mutable_material()->set_air_lift(kNaN); },
                    "spec.material.air_lift", "nan"},
        BadCreation{"NoShape", [](auto& r) { Spec(r).mutable_environment()->add_colliders(); },
                    "spec.environment.colliders[4]", "sphere, plane, capsule, box, cylinder, mesh"},
        BadCreation{"NoRadius", [](auto& r) { Sphere(r).set_radius_m(0); },
                    "spec.environment.colliders[0].sphere.radius_m", "0 is not in"},
        BadCreation{"NoCenter", [](auto& r) { Sphere(r).clear_center_m(); },
                    "spec.environment.colliders[0].sphere.center_m", "has 0 elements"},
        BadCreation{"NoNormal",
                    [](auto& r) {
                      Set(Plane(r).mutable_normal(), {0, 0, 0});
                    },
                    "spec.environment.colliders[1].plane.normal", "no direction"},
        BadCreation{"NotANumberPoint", [](auto& r) { Plane(r).set_point_m(2, kNaN); },
                    "spec.environment.colliders[1].plane.point_m[2]", "nan"},
        BadCreation{"NoCapsuleRadius", [](auto& r) { Capsule(r).set_radius_m(-0.5); },
                    "spec.environment.colliders[2].capsule.radius_m", "-0.5 is not in"},
        BadCreation{"NoCapsuleEnd", [](auto& r) { Capsule(r).clear_b_m(); },
                    "spec.environment.colliders[2].capsule.b_m", "has 0 elements"},
        BadCreation{"FarCapsuleEnd", [](auto& r) { Capsule(r).set_a_m(1, 2e6); },
                    "spec.environment.colliders[2].capsule.a_m[1]", "2e+06"},
        BadCreation{"NoCylinderRadius", [](auto& r) { Cylinder(r).set_radius_m(0); },
                    "spec.environment.colliders[4].cylinder.radius_m", "0 is not in [1e-09"},
        BadCreation{"NoCylinderEnd", [](auto& r) { Cylinder(r).clear_a_m(); },
                    "spec.environment.colliders[4].cylinder.a_m", "has 0 elements"},
        BadCreation{"NotANumberCylinder", [](auto& r) { Cylinder(r).set_b_m(2, kNaN); },
                    "spec.environment.colliders[4].cylinder.b_m[2]", "nan"},
        BadCreation{"CylinderWithoutLength", [](auto& r) { Cylinder(r).set_b_m(1, -2); },
                    "spec.environment.colliders[4].cylinder.b_m",
                    "is 0 m from a_m, at least 1e-09 m are needed"},
        BadCreation{"NoBoxCenter", [](auto& r) { Box(r).clear_center_m(); },
                    "spec.environment.colliders[3].box.center_m", "has 0 elements"},
        BadCreation{"FlatBox", [](auto& r) { Box(r).set_half_extents_m(1, 0); },
                    "spec.environment.colliders[3].box.half_extents_m[1]", "0 is not in [1e-09"},
        BadCreation{"NotANumberBox", [](auto& r) { Box(r).set_half_extents_m(2, kNaN); },
                    "spec.environment.colliders[3].box.half_extents_m[2]", "nan"},
        BadCreation{"TwoHalfExtents",
                    [](auto& r) { Box(r).mutable_half_extents_m()->RemoveLast(); },
                    "spec.environment.colliders[3].box.half_extents_m", "needs 3"},
        BadCreation{"ThreeNumberBoxRotation",
                    [](auto& r) { Box(r).mutable_rotation_xyzw()->RemoveLast(); },
                    "spec.environment.colliders[3].box.rotation_xyzw", "needs 4"},
        BadCreation{"ZeroBoxRotation",
                    [](auto& r) {
                      Set(Box(r).mutable_rotation_xyzw(), {0, 0, 0, 0});
                    },
                    "spec.environment.colliders[3].box.rotation_xyzw", "not a rotation"},
        BadCreation{"ManyColliders",
                    [](auto& r) {
                      for (int k = 0; k < 257; ++k) {
                        *Spec(r).mutable_environment()->add_colliders()->mutable_sphere() =
                            Sphere(r);
                      }
                    },
                    "spec.environment.colliders", "at most 256"},
        BadCreation{
            "ColliderTooFast",
            [](auto& r) {
              Set(Spec(r).mutable_environment()->mutable_colliders(0)->mutable_velocity_m_per_s(),
                  {0, -1001, 0});
            },
            "spec.environment.colliders[0].velocity_m_per_s[1]", "-1001"},
        BadCreation{"ColliderTurnsIntoNothing",
                    [](auto& r) {
                      Set(Spec(r)
                              .mutable_environment()
                              ->mutable_colliders(1)
                              ->mutable_angular_velocity_rad_per_s(),
                          {0, 0, kNaN});
                    },
                    "spec.environment.colliders[1].angular_velocity_rad_per_s[2]", "nan"},
        BadCreation{"MassAndDensity",
                    [](auto& r) {
                      v1::Collider& c = *Spec(r).mutable_environment()->mutable_colliders(2);
                      c.set_mass_kg(1);
                      c.set_density_kg_per_m3(500);
                    },
                    "spec.environment.colliders[2].mass_kg", "set one of the two"},
        BadCreation{"NoDensity",
                    [](auto& r) {
                      Spec(r).mutable_environment()->mutable_colliders(2)->set_density_kg_per_m3(0);
                    },
                    "spec.environment.colliders[2].density_kg_per_m3", "1e-06"},
        BadCreation{
            "MassIsNoNumber",
            [](auto& r) { Spec(r).mutable_environment()->mutable_colliders(2)->set_mass_kg(kNaN); },
            "spec.environment.colliders[2].mass_kg", "nan"},
        BadCreation{
            "BodyWithPivot",
            [](auto& r) { Spec(r).mutable_environment()->mutable_colliders(3)->set_mass_kg(1); },
            "spec.environment.colliders[3].pivot_m", "centre of mass"},
        BadCreation{"PlaneWithMass",
                    [](auto& r) {
                      for (v1::Collider& c : *Spec(r).mutable_environment()->mutable_colliders()) {
                        if (c.has_plane()) c.set_mass_kg(1);
                      }
                    },
                    "spec.environment.colliders[1].mass_kg", "a plane has no mass"},
        BadCreation{"TooManyBodies",
                    [](auto& r) {
                      for (int k = 0; k < 17; ++k) {
                        v1::Collider& c = *Spec(r).mutable_environment()->add_colliders();
                        Set(c.mutable_sphere()->mutable_center_m(), {0, 0, 1.0 * k});
                        c.mutable_sphere()->set_radius_m(0.1);
                        c.set_mass_kg(1);
                      }
                    },
                    "spec.environment.colliders", "has 17 with a mass, at most 16"},
        BadCreation{
            "PivotOfTwoNumbers",
            [](auto& r) {
              Set(Spec(r).mutable_environment()->mutable_colliders(2)->mutable_pivot_m(), {0, 1});
            },
            "spec.environment.colliders[2].pivot_m", "needs 3"},
        BadCreation{"ZeroQuaternion",
                    [](auto& r) {
                      Set(Spec(r).mutable_transform()->mutable_rotation_xyzw(), {0, 0, 0, 0});
                    },
                    "spec.transform.rotation_xyzw", "not a rotation"},
        BadCreation{"ThreeNumberQuaternion",
                    [](auto& r) {
                      Set(Spec(r).mutable_transform()->mutable_rotation_xyzw(), {0, 0, 1});
                    },
                    "spec.transform.rotation_xyzw", "needs 4"},
        BadCreation{"NegativeDamping",
                    [](auto& r) { Spec(r).mutable_material()->set_damping_per_s(-1); },
                    "spec.material.damping_per_s", "-1"},
        BadCreation{"DynamicAboveStatic",
                    [](auto& r) { Spec(r).mutable_material()->set_friction_dynamic(0.6); },
                    "spec.material.friction_dynamic", "friction_static = 0.5"},
        BadCreation{"RestitutionAboveOne",
                    [](auto& r) { Spec(r).mutable_material()->set_restitution(1.01); },
                    "spec.material.restitution", "1.01"},
        BadCreation{"NegativeThickness",
                    [](auto& r) { Spec(r).mutable_material()->set_thickness_m(-0.1); },
                    "spec.material.thickness_m", "-0.1"}),
    NameOf());

TEST(SpecValues, UnsetRestLengthsAreThoseOfTheRestShape) {
  v1::CreateClothsRequest request = GoodCreation();
  Chain(request).mutable_distance_constraints(1)->set_rest_length_m(0.25);
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const auto& chain = std::get<ParticleTopology>(checked->description->topology);
  EXPECT_EQ(chain.distance_constraints[0].rest_length_m, 1);
  EXPECT_EQ(chain.distance_constraints[1].rest_length_m, 0.25);
  EXPECT_EQ(chain.springs[0].rest_length_m, 2);
}

// Woven fabric is what a mesh is unless it says how far it stretches, be it not at all.
TEST(SpecValues, MeshesStretchAsWovenFabricsDo) {
  v1::CreateClothsRequest request = GoodCreation();
  *Spec(request).mutable_mesh() = test::SquareMesh();
  Spec(request).clear_pins();
  v1::Material& material = *Spec(request).mutable_material();
  const auto read = [&] {
    const auto checked = CheckCreateCloths(request, {});
    EXPECT_TRUE(checked.ok()) << checked.status().ToString();
    return checked.ok() ? checked->description->material : StructuralMaterial();
  };
  material.clear_stretch_compliance_m_per_n();
  material.clear_stretch_stiffness_n_per_m();
  EXPECT_EQ(read().stretch_stiffness_n_per_m, kMeshStretchStiffness_n_per_m);
  material.set_stretch_compliance_m_per_n(0);
  EXPECT_EQ(read().stretch_stiffness_n_per_m, 0) << "inextensible by its own wish";
  material.clear_stretch_compliance_m_per_n();
  material.set_stretch_stiffness_n_per_m(0);
  EXPECT_EQ(read().stretch_stiffness_n_per_m, 0);
  material.set_stretch_stiffness_n_per_m(300);
  EXPECT_EQ(read().stretch_stiffness_n_per_m, 300);

  material.clear_stretch_stiffness_n_per_m();
  Spec(request).mutable_grid()->set_columns(2);
  Spec(request).mutable_grid()->set_rows(2);
  Spec(request).mutable_grid()->set_width_m(1);
  Spec(request).mutable_grid()->set_height_m(1);
  EXPECT_EQ(read().stretch_stiffness_n_per_m, 0) << "grids are inextensible";
}

TEST(SpecValues, CollidersMoveAboutTheirPivots) {
  v1::CreateClothsRequest request = GoodCreation();
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const auto& motions = checked->copies[1].parameters.collider_motions;
  ASSERT_EQ(motions.size(), 4u);
  EXPECT_EQ(motions[3].pivot_m, Eigen::Vector3d(2, 0, 0));
  EXPECT_EQ(motions[3].position_m, Eigen::Vector3d(2, 0, 0));
  EXPECT_EQ(motions[3].velocity_m_per_s, Eigen::Vector3d(0.5, 0, 0));
  EXPECT_EQ(motions[3].angular_velocity_rad_per_s, Eigen::Vector3d(0, 2, 0));
  // The middle of the capsule.
  EXPECT_EQ(motions[2].pivot_m, Eigen::Vector3d(0, -1, 0.25));
  EXPECT_TRUE(motions[2].velocity_m_per_s.isZero(0));

  v1::Collider* box = Spec(request).mutable_environment()->mutable_colliders(3);
  box->clear_velocity_m_per_s();
  box->clear_angular_velocity_rad_per_s();
  box->clear_pivot_m();
  EXPECT_TRUE(CheckCreateCloths(request, {})->copies[0].parameters.collider_motions.empty());
}

TEST(SpecValues, BodiesHaveMotionsAboutTheirCentres) {
  v1::CreateClothsRequest request = GoodCreation();
  v1::Collider* box = Spec(request).mutable_environment()->mutable_colliders(3);
  box->clear_velocity_m_per_s();
  box->clear_angular_velocity_rad_per_s();
  box->clear_pivot_m();
  Spec(request).mutable_environment()->mutable_colliders(2)->set_density_kg_per_m3(300);
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const ClothParameters& parameters = checked->copies[0].parameters;
  ASSERT_EQ(parameters.collider_motions.size(), 4u);  // though all of them are at rest
  EXPECT_EQ(parameters.collider_motions[2].position_m, Eigen::Vector3d(0, -1, 0.25));
  EXPECT_TRUE(parameters.colliders[2].is_body());
  EXPECT_EQ(parameters.colliders[2].density_kg_per_m3, 300);
  EXPECT_FALSE(parameters.colliders[3].is_body());
}

TEST(SpecValues, KindsAndJoints) {
  v1::CreateClothsRequest request = GoodCreation();
  v1::Particles& particles = Chain(request);
  particles.mutable_distance_constraints(0)->set_kind(v1::DistanceConstraint::AT_MOST);
  particles.mutable_distance_constraints(1)->set_kind(v1::DistanceConstraint::AT_LEAST);
  v1::PointJoint* joint = particles.add_point_joints();
  joint->set_i(2);
  joint->set_compliance_m_per_n(1e-3);
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const auto& chain = std::get<ParticleTopology>(checked->description->topology);
  EXPECT_EQ(chain.distance_constraints[0].kind, ConstraintKind::kAtMost);
  EXPECT_EQ(chain.distance_constraints[1].kind, ConstraintKind::kAtLeast);
  ASSERT_EQ(chain.point_joints.size(), 1u);
  EXPECT_EQ(chain.point_joints[0].i, 2u);
  EXPECT_EQ(chain.point_joints[0].compliance_m_per_n, 1e-3);
}

TEST(SpecValues, CapsulesAndBoxes) {
  v1::CreateClothsRequest request = GoodCreation();
  auto checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const auto& colliders = checked->copies[0].parameters.colliders;
  EXPECT_EQ(colliders[2], CapsuleBetween({-1, -1, 0}, {1, -1, 0.5}, 0.25));
  const Collider& box = colliders[3];
  EXPECT_EQ(box.pose.position_m, Eigen::Vector3d(2, -1, 0));
  EXPECT_EQ(box.shape, Shape(BoxShape{{0.5, 0.25, 1}}));
  EXPECT_NEAR((box.pose.rotation.coeffs() - Eigen::Vector4d(0, 0.6, 0, 0.8)).norm(), 0, 1e-15);

  Box(request).clear_rotation_xyzw();
  checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  EXPECT_EQ(checked->copies[0].parameters.colliders[3].pose.rotation.coeffs(),
            Eigen::Vector4d(0, 0, 0, 1));
}

TEST(SpecValues, ACylinderReadsBackAsItWasAskedFor) {
  v1::CreateClothsRequest request = GoodCreation();
  const v1::Cylinder asked = Cylinder(request);
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const Collider& cylinder = checked->copies[0].parameters.colliders[4];
  EXPECT_EQ(cylinder, CylinderBetween({0, -2, 0}, {0, -1, 0}, 0.25));
  EXPECT_EQ(ToProto(cylinder).cylinder().SerializeAsString(), asked.SerializeAsString());
  EXPECT_EQ(checked->copies[0].parameters.collider_motions[4].pivot_m, Eigen::Vector3d(0, -1.5, 0));
}

TEST(SpecValues, HugeAndTinyVectorsKeepTheirDirection) {
  v1::CreateClothsRequest request = GoodCreation();
  Set(Plane(request).mutable_normal(), {3e-300, 0, 4e-300});
  Set(Spec(request).mutable_transform()->mutable_rotation_xyzw(), {0, 1e15, 0, 0});
  request.clear_transforms();
  const auto checked = CheckCreateCloths(request, {});
  ASSERT_TRUE(checked.ok()) << checked.status().ToString();
  const auto& plane = std::get<PlaneShape>(checked->copies[0].parameters.colliders[1].shape);
  // Rounding of one division and one square root per component.
  EXPECT_NEAR((plane.normal - Eigen::Vector3d(0.6, 0, 0.8)).norm(), 0, 1e-15);
  EXPECT_EQ(checked->copies[0].transform.rotation.y(), 1);
}

}  // namespace
}  // namespace drape::api
