// Refusals of SceneModel::Build: one row per way to be wrong, with the field that must be named and
// a piece of the text that must say what is legal.
#include "server/scene/description_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <limits>

namespace drape {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

ModelDescription GoodGrid() {
  ModelDescription description;
  description.topology = GridTopology{.columns = 4, .rows = 3, .width_m = 1, .height_m = 1};
  description.pinned_particles = {3, 0};
  return description;
}

ModelDescription GoodMesh() {
  TriangleMesh mesh;
  for (int k = 0; k < 16; ++k) mesh.positions_m.emplace_back(k % 4, 0, k / 4);
  for (uint32_t row = 0; row < 3; ++row) {
    for (uint32_t column = 0; column < 3; ++column) {
      const uint32_t a = 4 * row + column;
      mesh.triangles.push_back({a, a + 4, a + 1});
      mesh.triangles.push_back({a + 1, a + 4, a + 5});
    }
  }
  ModelDescription description;
  description.topology = mesh;
  return description;
}

ModelDescription GoodParticles() {
  ParticleTopology particles;
  for (int k = 0; k < 5; ++k) particles.positions_m.emplace_back(k, 0, 0);
  particles.masses_kg.assign(5, 0.1);
  for (uint32_t k = 0; k + 1 < 5; ++k) {
    particles.distance_constraints.push_back({.i = k, .j = k + 1, .rest_length_m = 1});
  }
  particles.springs = {{.i = 0, .j = 2, .rest_length_m = 2, .stiffness_n_per_m = 1}};
  ModelDescription description;
  description.topology = particles;
  return description;
}

struct BadDescription {
  std::string name;
  ModelDescription (*good)();
  std::function<void(ModelDescription&)> spoil;
  std::string field;
  std::string text;
};

using Edit = std::function<void(ModelDescription&)>;
Edit OnGrid(std::function<void(GridTopology&)> edit) {
  return [edit](ModelDescription& d) { edit(std::get<GridTopology>(d.topology)); };
}
Edit OnMesh(std::function<void(TriangleMesh&)> edit) {
  return [edit](ModelDescription& d) { edit(std::get<TriangleMesh>(d.topology)); };
}
Edit OnParticles(std::function<void(ParticleTopology&)> edit) {
  return [edit](ModelDescription& d) { edit(std::get<ParticleTopology>(d.topology)); };
}
Edit OnMaterial(std::function<void(StructuralMaterial&)> edit) {
  return [edit](ModelDescription& d) { edit(d.material); };
}
Edit SetPins(std::vector<uint32_t> pins) {
  return [pins](ModelDescription& d) { d.pinned_particles = pins; };
}

std::vector<BadDescription> BadGrids() {
  return {
      {"no columns", GoodGrid, OnGrid([](auto& g) { g.columns = 0; }), "grid.columns", ">= 1"},
      {"no rows", GoodGrid, OnGrid([](auto& g) { g.rows = 0; }), "grid.rows", ">= 1"},
      {"one particle", GoodGrid, OnGrid([](auto& g) { g.columns = g.rows = 1; }), "grid.columns",
       ">= 2"},
      {"billion particles", GoodGrid, OnGrid([](auto& g) {
         g.columns = 1000000000;
         g.rows = 1;
       }),
       "grid.columns", "1000000000 particles (columns * rows); at most 1048576"},
      {"overflowing product", GoodGrid, OnGrid([](auto& g) { g.columns = g.rows = 65536; }),
       "grid.columns", "4294967296 particles"},
      {"largest product", GoodGrid, OnGrid([](auto& g) { g.columns = g.rows = 0xffffffffu; }),
       "grid.columns", "18446744065119617025 particles"},
      {"no width", GoodGrid, OnGrid([](auto& g) { g.width_m = 0; }), "grid.width_m",
       "0 is not in (0, 1e+06] m"},
      {"negative height", GoodGrid, OnGrid([](auto& g) { g.height_m = -1; }), "grid.height_m",
       "-1 is not in (0, 1e+06] m"},
      {"NaN width", GoodGrid, OnGrid([](auto& g) { g.width_m = kNan; }), "grid.width_m", "nan"},
      {"infinite height", GoodGrid, OnGrid([](auto& g) { g.height_m = kInf; }), "grid.height_m",
       "inf"},
      {"spacing below the shortest", GoodGrid, OnGrid([](auto& g) { g.width_m = 1e-10; }),
       "grid.width_m", "at least 1e-09 m"},
      {"tiny particle masses", GoodGrid,
       OnMaterial([](auto& m) { m.areal_density_kg_per_m2 = 1e-13; }),
       "material.areal_density_kg_per_m2", "[1e-12, 1e+12] kg"},
      {"no density", GoodGrid, OnMaterial([](auto& m) { m.areal_density_kg_per_m2 = 0; }),
       "material.areal_density_kg_per_m2", "0 is not in (0, "},
      {"NaN density", GoodGrid, OnMaterial([](auto& m) { m.areal_density_kg_per_m2 = kNan; }),
       "material.areal_density_kg_per_m2", "nan"},
      {"negative compliance", GoodGrid,
       OnMaterial([](auto& m) { m.stretch_compliance_m_per_n = -1; }),
       "material.stretch_compliance_m_per_n", "-1 is not in [0, "},
      {"infinite bending", GoodGrid,
       OnMaterial([](auto& m) { m.bending_stiffness_n_per_m = kInf; }),
       "material.bending_stiffness_n_per_m", "inf is not in [0, "},
      {"negative rigidity", GoodGrid, OnMaterial([](auto& m) { m.bending_rigidity_n_m = -1; }),
       "material.bending_rigidity_n_m", "-1 is not in [0, 1e+06] N m"},
      {"rigidity of particles", GoodParticles,
       OnMaterial([](auto& m) { m.bending_rigidity_n_m = 1; }), "material.bending_rigidity_n_m",
       "belongs to grids and meshes"},
      {"modulus of particles", GoodParticles,
       OnMaterial([](auto& m) { m.shear_modulus_n_per_m = 1; }), "material.shear_modulus_n_per_m",
       "1 belongs to grids and meshes"},
      {"negative stiffness", GoodGrid,
       OnMaterial([](auto& m) { m.stretch_stiffness_n_per_m = -3; }),
       "material.stretch_stiffness_n_per_m", "-3 is not in [0, "},
      {"hardly any stiffness", GoodGrid,
       OnMaterial([](auto& m) { m.stretch_stiffness_n_per_m = 1e-300; }),
       "material.stretch_stiffness_n_per_m", "gives an edge the compliance"},
      {"stiffness and compliance", GoodGrid, OnMaterial([](auto& m) {
         m.stretch_stiffness_n_per_m = 100;
         m.stretch_compliance_m_per_n = 0.5;
       }),
       "material.stretch_stiffness_n_per_m",
       "100 N/m together with material.stretch_compliance_m_per_n 0.5 m/N"},
      {"negative modulus", GoodGrid, OnMaterial([](auto& m) { m.shear_modulus_n_per_m = -4; }),
       "material.shear_modulus_n_per_m", "-4 is not in [0, "},
      {"modulus and springs", GoodGrid, OnMaterial([](auto& m) {
         m.shear_modulus_n_per_m = 10;
         m.shear_stiffness_n_per_m = 2;
       }),
       "material.shear_modulus_n_per_m",
       "10 N/m together with material.shear_stiffness_n_per_m 2 N/m"},
      {"negative shear", GoodGrid, OnMaterial([](auto& m) { m.shear_stiffness_n_per_m = -2; }),
       "material.shear_stiffness_n_per_m", "-2 is not in [0, "},
      {"pin out of range", GoodGrid, SetPins({0, 1, 12}), "pins[2].particle",
       "12 is not in [0, 11]"},
      {"pin twice", GoodGrid, SetPins({5, 0, 5}), "pins[2].particle", "5 is pinned already"},
  };
}

std::vector<BadDescription> BadMeshes() {
  return {
      {"no triangles", GoodMesh, OnMesh([](auto& m) { m.triangles.clear(); }), "mesh.triangles",
       "at least 1"},
      {"no vertices", GoodMesh, OnMesh([](auto& m) { m.positions_m.clear(); }), "mesh.triangles[0]",
       "no particles"},
      {"index out of range", GoodMesh, OnMesh([](auto& m) { m.triangles[7][1] = 16; }),
       "mesh.triangles[7]", "16 is not in [0, 15]"},
      {"NaN position", GoodMesh, OnMesh([](auto& m) { m.positions_m[12].y() = kNan; }),
       "mesh.positions_m[12]", "nan"},
      {"infinite position", GoodMesh, OnMesh([](auto& m) { m.positions_m[3].x() = -kInf; }),
       "mesh.positions_m[3]", "-inf"},
      {"far position", GoodMesh, OnMesh([](auto& m) { m.positions_m[3].x() = 2e6; }),
       "mesh.positions_m[3]", "[-1e+06, 1e+06] m"},
      {"only degenerate triangles", GoodMesh, OnMesh([](auto& m) {
         m.triangles = {{0, 1, 2}, {5, 5, 6}};
       }),
       "mesh.triangles", "all 2 triangles have no area"},
      {"hub of 1025 edges", GoodMesh, OnMesh([](auto& m) {
         m.positions_m = {{0, 0, 0}};
         m.triangles.clear();
         for (uint32_t k = 0; k < 1025; ++k) {
           m.positions_m.emplace_back(std::cos(k * 0.005), 0, std::sin(k * 0.005));
         }
         for (uint32_t k = 1; k < 1025; ++k) m.triangles.push_back({0, k, k + 1});
       }),
       "mesh.triangles", "particle 0 has 1025 distance constraints; at most 1024"},
      {"book of 65 pages", GoodMesh, OnMesh([](auto& m) {
         m = {.positions_m = {{0, 0, 0}, {0, 1, 0}}, .triangles = {}};
         for (uint32_t k = 0; k < 65; ++k) {
           m.positions_m.emplace_back(std::cos(k * 0.09), 0.5, std::sin(k * 0.09));
           m.triangles.push_back({0, 1, k + 2});
         }
       }),
       "mesh.triangles", "the edge of particles 0 and 1 has 65 triangles; at most 64"},
      {"every two points of a rim with its hub", GoodMesh, OnMesh([](auto& m) {
         m = {.positions_m = {{0, 1, 0}}, .triangles = {}};
         for (uint32_t k = 1; k <= 60; ++k) {
           m.positions_m.emplace_back(std::cos(k * 0.1), 0, std::sin(k * 0.1));
           for (uint32_t l = 1; l < k; ++l) m.triangles.push_back({0, k, l});
         }
       }),
       "mesh.triangles", "vertex 0 has 1770 triangles; at most 1024"},
      {"two hubs that become one", GoodMesh, OnMesh([](auto& m) {
         m = {};
         for (const uint32_t hub : {0u, 41u}) {
           m.positions_m.emplace_back(1e-4 * hub, 1, 0);
           for (uint32_t k = 1; k <= 40; ++k) {
             const double angle = 0.07 * (hub + k);
             m.positions_m.emplace_back(std::cos(angle), 0, std::sin(angle));
             for (uint32_t l = 1; l < k; ++l) m.triangles.push_back({hub, hub + k, hub + l});
           }
         }
         m.triangles.push_back({0, 41, 1});
       }),
       "mesh.triangles", "particle 0 has 1560 triangles; at most 1024"},
      {"five fans", GoodMesh, OnMesh([](auto& m) {
         m = {};
         for (uint32_t fan = 0; fan < 5; ++fan) {
           const auto hub = static_cast<uint32_t>(m.positions_m.size());
           m.positions_m.emplace_back(3 * fan, 0, 0);
           for (uint32_t k = 1; k <= 1000; ++k) {
             m.positions_m.emplace_back(3 * fan + std::cos(k * 0.006), 0, std::sin(k * 0.006));
             if (k > 1) m.triangles.push_back({hub, hub + k - 1, hub + k});
           }
         }
       }),
       "mesh.triangles", "very many triangles meet at too many vertices"},
  };
}

std::vector<BadDescription> BadParticles() {
  return {
      {"no particles", GoodParticles, OnParticles([](auto& p) { p = {}; }), "particles.positions_m",
       "at least 1"},
      {"short masses", GoodParticles, OnParticles([](auto& p) { p.masses_kg.pop_back(); }),
       "particles.masses_kg", "4 masses for 5 particles"},
      {"zero mass", GoodParticles, OnParticles([](auto& p) { p.masses_kg[3] = 0; }),
       "particles.masses_kg[3]", "0 is not in ["},
      {"negative mass", GoodParticles, OnParticles([](auto& p) { p.masses_kg[3] = -1; }),
       "particles.masses_kg[3]", "-1 is not in ["},
      {"infinite mass", GoodParticles, OnParticles([](auto& p) { p.masses_kg[0] = kInf; }),
       "particles.masses_kg[0]", "inf is not in ["},
      {"NaN mass", GoodParticles, OnParticles([](auto& p) { p.masses_kg[4] = kNan; }),
       "particles.masses_kg[4]", "nan is not in ["},
      {"NaN position", GoodParticles, OnParticles([](auto& p) { p.positions_m[1].z() = kNan; }),
       "particles.positions_m[1]", "nan"},
      {"i out of range", GoodParticles,
       OnParticles([](auto& p) { p.distance_constraints[2].i = 5; }),
       "particles.distance_constraints[2].i", "5 is not in [0, 4]"},
      {"j out of range", GoodParticles,
       OnParticles([](auto& p) { p.distance_constraints[2].j = 99; }),
       "particles.distance_constraints[2].j", "99 is not in [0, 4]"},
      {"i is j", GoodParticles, OnParticles([](auto& p) { p.distance_constraints[1].j = 1; }),
       "particles.distance_constraints[1].j", "equals i"},
      {"rest length 0", GoodParticles,
       OnParticles([](auto& p) { p.distance_constraints[0].rest_length_m = 0; }),
       "particles.distance_constraints[0].rest_length_m", "0 is not in [1e-09, 1e+06] m"},
      {"NaN rest length", GoodParticles,
       OnParticles([](auto& p) { p.distance_constraints[0].rest_length_m = kNan; }),
       "particles.distance_constraints[0].rest_length_m", "nan"},
      {"negative compliance", GoodParticles,
       OnParticles([](auto& p) { p.distance_constraints[3].compliance_m_per_n = -1e-3; }),
       "particles.distance_constraints[3].compliance_m_per_n", "-0.001 is not in [0, "},
      {"coincident", GoodParticles,
       OnParticles([](auto& p) { p.positions_m[1] = p.positions_m[0]; }),
       "particles.distance_constraints[0]", "particles 0 and 1 coincide"},
      {"spring i", GoodParticles, OnParticles([](auto& p) { p.springs[0].i = 7; }),
       "particles.springs[0].i", "7 is not in [0, 4]"},
      {"spring to itself", GoodParticles, OnParticles([](auto& p) { p.springs[0].j = 0; }),
       "particles.springs[0].j", "equals i"},
      {"negative spring", GoodParticles,
       OnParticles([](auto& p) { p.springs[0].stiffness_n_per_m = -3; }),
       "particles.springs[0].stiffness_n_per_m", "-3 is not in [0, "},
      {"infinite damping", GoodParticles,
       OnParticles([](auto& p) { p.springs[0].damping_n_s_per_m = kInf; }),
       "particles.springs[0].damping_n_s_per_m", "inf is not in [0, "},
      {"negative spring length", GoodParticles,
       OnParticles([](auto& p) { p.springs[0].rest_length_m = -1; }),
       "particles.springs[0].rest_length_m", "-1 is not in [0, "},
      {"joint out of range", GoodParticles, OnParticles([](auto& p) {
         p.point_joints = {{1, 2, 0}, {4, 5, 0}};
       }),
       "particles.point_joints[1].j", "5 is not in [0, 4]"},
      {"joint to itself", GoodParticles, OnParticles([](auto& p) {
         p.point_joints = {{2, 2, 0}};
       }),
       "particles.point_joints[0].j", "equals i"},
      {"joint of negative compliance", GoodParticles, OnParticles([](auto& p) {
         p.point_joints = {{1, 2, -1e-3}};
       }),
       "particles.point_joints[0].compliance_m_per_n", "-0.001 is not in [0, "},
      {"1100 joints of two particles", GoodParticles, OnParticles([](auto& p) {
         p.point_joints.assign(1100, {1, 2, 0});
       }),
       "particles.point_joints", "particle 1 has 1100 joints; at most 1024"},
      {"1100 springs of two particles", GoodParticles,
       OnParticles([](auto& p) { p.springs.assign(1100, p.springs[0]); }), "particles.springs",
       "particle 0 has 1100 springs; at most 1024"},
      {"pin", GoodParticles, SetPins({5}), "pins[0].particle", "5 is not in [0, 4]"},
  };
}

class BadDescriptions : public ::testing::TestWithParam<BadDescription> {};

TEST_P(BadDescriptions, AreRefusedNamingTheField) {
  ModelDescription description = GetParam().good();
  ASSERT_TRUE(SceneModel::Build(description).ok())
      << SceneModel::Build(description).status().message();
  GetParam().spoil(description);
  const Status status = SceneModel::Build(description).status();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  ASSERT_FALSE(status.violations().empty());
  const FieldViolation& first = status.violations().front();
  EXPECT_EQ(first.field, GetParam().field) << status.message();
  EXPECT_THAT(first.description, ::testing::HasSubstr(GetParam().text));
}

std::string CaseName(const ::testing::TestParamInfo<BadDescription>& info) {
  std::string name = info.param.name;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}
INSTANTIATE_TEST_SUITE_P(Grid, BadDescriptions, ::testing::ValuesIn(BadGrids()), CaseName);
INSTANTIATE_TEST_SUITE_P(Mesh, BadDescriptions, ::testing::ValuesIn(BadMeshes()), CaseName);
INSTANTIATE_TEST_SUITE_P(Particles, BadDescriptions, ::testing::ValuesIn(BadParticles()), CaseName);

TEST(DescriptionChecks, SeveralViolationsAreToldAtOnceButNotMoreThanSixteen) {
  ModelDescription description = GoodMesh();
  for (auto& p : std::get<TriangleMesh>(description.topology).positions_m) p.x() = kNan;
  std::get<TriangleMesh>(description.topology).positions_m[0].x() = 0;
  EXPECT_EQ(CheckDescription(description, {}).size(), 15u);
  description.material.areal_density_kg_per_m2 = -1;
  description.material.shear_stiffness_n_per_m = -1;
  EXPECT_EQ(CheckDescription(description, {}).size(), 16u);
}

TEST(DescriptionChecks, LimitsAreThoseOfTheCaller) {
  const auto field = [](const ModelDescription& description, const ModelLimits& limits) {
    const Status status = SceneModel::Build(description, limits).status();
    return status.ok() ? std::string() : status.violations().front().field;
  };
  EXPECT_EQ(field(GoodGrid(), {.max_particles = 12}), "");
  EXPECT_EQ(field(GoodGrid(), {.max_particles = 11}), "grid.columns");
  EXPECT_EQ(field(GoodGrid(), {.max_constraints = 17}), "");
  EXPECT_EQ(field(GoodGrid(), {.max_constraints = 16}), "grid.columns");
  EXPECT_EQ(field(GoodMesh(), {.max_particles = 15}), "mesh.positions_m");
  EXPECT_EQ(field(GoodMesh(), {.max_constraints = 17}), "mesh.triangles");
  EXPECT_EQ(field(GoodParticles(), {.max_particles = 4}), "particles.positions_m");
  EXPECT_EQ(field(GoodParticles(), {.max_constraints = 3}), "particles.distance_constraints");
  EXPECT_EQ(field(GoodParticles(), {.max_degree = 1}), "particles.distance_constraints");
}

// Nothing may be allocated for it: the answer comes at once, on any machine.
TEST(DescriptionChecks, AnAbsurdGridIsRefusedAtOnce) {
  ModelDescription description = GoodGrid();
  std::get<GridTopology>(description.topology).columns = 1000000000;
  description.pinned_particles.assign(100, 7);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_FALSE(SceneModel::Build(description).ok());
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(100));
}

}  // namespace
}  // namespace drape
