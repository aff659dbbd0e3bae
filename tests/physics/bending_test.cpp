// Bending rigidity (server/solver/method.md, "apply_elastic"): strips that are held by one end
// against the elastica, at rest and in vibration, at several resolutions.
//
// A strip of lines of particles across it is a chain of stiff joints: a line stands for a mass and
// resists the angle t at it with the moment S sin t, S = B width / spacing for grids; for meshes of
// equilateral triangles with edges across, S = B (length of the inner edges of that line) /
// spacing. Where the strip is clamped, at its second line, half of the cloth bends: S is twice
// that.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tests/physics/preset_test.h"
#include "tests/support/elastica.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr double kDensity_kg_per_m2 = 0.2;
constexpr double kLength_m = 0.5;
constexpr double kWidth_m = 0.25;
constexpr double kGravity_m_per_s2 = 9.81;
// Its weight bends the strip down by 0.4 of its length.
constexpr double kRigidity_n_m = kDensity_kg_per_m2 * kGravity_m_per_s2 * 0.5 * 0.5 * 0.5 / 5;

// A strip along +x, clamped at the second of its lines of particles, and the chain that it is.
struct Strip {
  Scene scene;
  StiffChain chain;
  std::vector<uint32_t> line_of_particle;  // [particle_count]
};

void HoldFirstLines(ModelDescription& description, const std::vector<uint32_t>& line_of_particle) {
  for (uint32_t i = 0; i < line_of_particle.size(); ++i) {
    if (line_of_particle[i] < 2) description.pinned_particles.push_back(i);
  }
}

void Finish(ModelDescription description, Strip& strip) {
  description.material = {.areal_density_kg_per_m2 = kDensity_kg_per_m2,
                          .bending_rigidity_n_m = kRigidity_n_m};
  HoldFirstLines(description, strip.line_of_particle);
  strip.chain.stiffnesses_n_m[1] *= 2;
  strip.scene.model = BuildModel(description);
  strip.scene.state = RestState(*strip.scene.model);
  strip.chain.masses_kg.assign(strip.chain.stiffnesses_n_m.size(), 0);
  for (uint32_t i = 0; i < strip.scene.model->particle_count(); ++i) {
    strip.chain.masses_kg[strip.line_of_particle[i]] += strip.scene.model->masses_kg()[i];
  }
}

// Along the rows of a grid, or along its columns: kLength_m beyond the clamp.
Strip GridStrip(uint32_t lines, uint32_t across, bool is_along_columns = false) {
  Strip strip;
  strip.chain.link_m = kLength_m / (lines - 2);
  strip.chain.stiffnesses_n_m.assign(lines, kRigidity_n_m * kWidth_m / strip.chain.link_m);
  const double length_m = kLength_m + strip.chain.link_m;
  GridTopology grid{lines, across, length_m, kWidth_m};
  if (is_along_columns) grid = {across, lines, kWidth_m, length_m};
  for (uint32_t i = 0; i < lines * across; ++i) {
    strip.line_of_particle.push_back(is_along_columns ? i / across : i % lines);
  }
  Finish({grid, {}, {}}, strip);
  return strip;
}

// Equilateral triangles with edges across: `across` of them on even lines, one less on odd ones.
Strip MeshStrip(uint32_t lines, uint32_t across) {
  Strip strip;
  const double spacing = kLength_m / (lines - 1);
  const double edge = spacing * 2 / std::sqrt(3.0);
  strip.chain.link_m = spacing;
  TriangleMesh mesh;
  std::vector<uint32_t> first;  // particle of each line
  for (uint32_t line = 0; line < lines; ++line) {
    const bool is_odd = line % 2 == 1;
    const uint32_t edges = across - is_odd;
    first.push_back(static_cast<uint32_t>(mesh.positions_m.size()));
    strip.chain.stiffnesses_n_m.push_back(kRigidity_n_m * edges * edge / spacing);
    for (uint32_t k = 0; k <= edges; ++k) {
      mesh.positions_m.emplace_back(line * spacing, 0, (k + (is_odd ? 0.5 : 0)) * edge);
      strip.line_of_particle.push_back(line);
    }
  }
  for (uint32_t line = 0; line + 1 < lines; ++line) {
    const uint32_t even = first[line + line % 2], odd = first[line + 1 - line % 2];
    for (uint32_t k = 0; k < across; ++k) {
      mesh.triangles.push_back({even + k, even + k + 1, odd + k});
      if (k > 0) mesh.triangles.push_back({even + k, odd + k - 1, odd + k});
    }
  }
  Finish({mesh, {}, {}}, strip);
  return strip;
}

// Each line where the chain is.
void Shape(Strip& strip, const std::vector<double>& along_m, const std::vector<double>& up_m) {
  const bool is_along_z = strip.scene.model->grid_rows() == along_m.size();
  for (uint32_t i = 0; i < strip.line_of_particle.size(); ++i) {
    Vector3d& p = strip.scene.state.positions_m[i];
    p[is_along_z ? 2 : 0] = along_m[strip.line_of_particle[i]];
    p.y() = up_m[strip.line_of_particle[i]];
  }
}

void Hang(Strip& strip) {
  const std::vector<double> angles = HangingAngles(strip.chain, kGravity_m_per_s2);
  std::vector<double> along_m = {0}, up_m = {0};
  for (const double angle : angles) {
    along_m.push_back(along_m.back() + strip.chain.link_m * std::cos(angle));
    up_m.push_back(up_m.back() - strip.chain.link_m * std::sin(angle));
  }
  Shape(strip, along_m, up_m);
}

// Turns the scene: nothing but its place in the frame changes.
void Turn(Scene& scene) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Vector3d(1, -2, 0.5).normalized()));
  for (Vector3d& p : scene.state.positions_m) p = turn * p;
  scene.parameters.gravity_m_per_s2 = turn * scene.parameters.gravity_m_per_s2;
  for (const uint32_t pin : scene.model->pins()) {
    scene.pin_targets_m.push_back(scene.state.positions_m[pin]);
  }
}

// Substeps per 1/60 s in which h^2 omega^2 of the fastest element is `ratio`.
uint32_t SubstepsFor(const Scene& scene, double ratio) {
  const double h = std::sqrt(ratio / scene.model->elastic_frequency_sq_bound());
  return static_cast<uint32_t>(std::ceil(1 / (60 * h)));
}

class Bending : public PhysicsTest {
 protected:
  // Largest distance of a particle from its place in the scene, over `steps` steps.
  double LargestMotion(const Scene& scene, uint32_t steps) {
    const ClothHandle cloth = Make(scene);
    double largest = 0;
    for (uint32_t step = 0; step < steps; ++step) {
      const StepReport report = StepAlone(backend(), cloth, scene);
      EXPECT_FALSE(report.warnings.elastic_beyond_limit);
      const auto positions_m = ReadState(backend(), cloth).positions_m;
      largest = std::max(largest, FindWorst(positions_m, scene.state.positions_m).distance);
    }
    return largest;
  }
};

// The strip starts in the equilibrium of the chain and is left alone: it stays, up to an error of
// second order that vanishes with the step. Rounded places turn every line by 4 roundings of the
// length over the spacing, and the end moves by their sum, at worst.
TEST_P(Bending, AHeavyStripHangsAsTheElasticaOfItsResolution) {
  for (const bool is_along_columns : {false, true}) {
    for (const uint32_t lines : {9u, 13u}) {
      SCOPED_TRACE(std::to_string(lines) + (is_along_columns ? " columns" : " rows"));
      Strip strip = GridStrip(lines, 3, is_along_columns);
      Hang(strip);
      Turn(strip.scene);
      strip.scene.parameters.settings.max_iterations = 10;
      const uint32_t substeps = SubstepsFor(strip.scene, 0.2);
      std::array<double, 3> motions;
      for (size_t k = 0; k < 3; ++k) {
        strip.scene.parameters.settings.substeps = substeps << k;
        motions[k] = LargestMotion(strip.scene, 6);
      }
      const double rounding = 4 * round_off() * kLength_m * lines * lines;
      ExpectOrder(motions, 2, rounding);
      ExpectLimit(motions, 2, 0, rounding, "motion");
    }
  }
}

// A strip of triangles has half triangles at its rims that no hinge bends: the chain lacks half of
// one of the `across` edges. The unbalanced part is at most this share of the weight, and the strip
// falls by it.
TEST_P(Bending, AHeavyStripOfTrianglesHangsAlmostAlike) {
  constexpr uint32_t kSteps = 6;
  for (const uint32_t across : {3u, 5u}) {
    Strip strip = MeshStrip(4 * across + 1, across);
    Hang(strip);
    strip.scene.parameters.settings.max_iterations = 10;
    strip.scene.parameters.settings.substeps = SubstepsFor(strip.scene, 0.5);
    const double time_s = kSteps / 60.0;
    EXPECT_LE(LargestMotion(strip.scene, kSteps),
              kGravity_m_per_s2 * time_s * time_s / 2 / (2 * across));
  }
}

// The end of the chain sinks as that of the elastica, to first order in the spacing (the last line
// weighs as much as the others); and the elastica itself, where it is hardly bent, by w L^4 / 8B.
TEST(ElasticaTest, IsWhatTheChainsBecome) {
  const double weight_n_per_m = kDensity_kg_per_m2 * kGravity_m_per_s2;
  const double light = weight_n_per_m * 1e-4;
  EXPECT_NEAR(ElasticaDrop_m(kLength_m, kRigidity_n_m, light),
              light * std::pow(kLength_m, 4) / (8 * kRigidity_n_m), 1e-8 * kLength_m);
  const double drop_m = ElasticaDrop_m(kLength_m, kRigidity_n_m, weight_n_per_m);
  std::array<double, 3> drops_m{}, errors_m{};
  for (size_t k = 0; k < 3; ++k) {
    const Strip strip = GridStrip((8u << k) + 2, 3);
    for (const double angle : HangingAngles(strip.chain, kGravity_m_per_s2)) {
      drops_m[k] += strip.chain.link_m * std::sin(angle);
    }
    errors_m[k] = std::abs(drops_m[k] - drop_m);
  }
  ExpectOrder(errors_m, 1, 1e-9);
  ExpectLimit(drops_m, 1, drop_m, 1e-9, "drop");
}

// In the slowest mode of the chain, of amplitude A: A cos(w t) everywhere, to second order in the
// step; a line is drawn in by A^2 over the length, which takes that much of its inertia along.
TEST_P(Bending, AStripVibratesAtTheFrequencyOfItsResolution) {
  constexpr double kAmplitude_m = 5e-4;
  constexpr uint32_t kSteps = 13;  // about a quarter of a period
  for (const uint32_t lines : {9u, 13u}) {
    SCOPED_TRACE(lines);
    Strip strip = GridStrip(lines, 3);
    const Vibration vibration = SlowestVibration(strip.chain);
    std::vector<double> along_m, up_m;
    for (uint32_t line = 0; line < lines; ++line) {
      along_m.push_back(line * strip.chain.link_m);
      up_m.push_back(kAmplitude_m * vibration.shape[line]);
    }
    Shape(strip, along_m, up_m);
    strip.scene.parameters.gravity_m_per_s2.setZero();
    strip.scene.parameters.settings.use_tethers = false;  // a straight strip is at their bound
    const double angle = vibration.frequency_per_s * kSteps / 60;
    const uint32_t substeps = SubstepsFor(strip.scene, 0.2);
    std::array<double, 3> errors{};
    for (size_t k = 0; k < 3; ++k) {
      strip.scene.parameters.settings.substeps = substeps << k;
      const ParticleState state = StateAfter(strip.scene, kSteps);
      for (uint32_t i = 0; i < strip.line_of_particle.size(); ++i) {
        const double expected = std::cos(angle) * up_m[strip.line_of_particle[i]];
        errors[k] = std::max(errors[k], std::abs(state.positions_m[i].y() - expected));
      }
    }
    const double floor_m = kAmplitude_m * std::pow(kAmplitude_m / kLength_m, 2) +
                           4 * round_off() * kLength_m * lines * lines;
    ExpectOrder(errors, 2, floor_m);
    EXPECT_LE(errors[0], kAmplitude_m / 1000 + floor_m) << "far less than a percent of stiffness";
  }
}

// w = 1.8751^2 sqrt(B / (rho L^4)) (Bernoulli, Euler), to first order in the spacing.
TEST(ElasticaTest, VibratesAtTheFrequencyThatTheChainsApproach) {
  const double exact = std::pow(1.8751040687, 2) *
                       std::sqrt(kRigidity_n_m / kDensity_kg_per_m2 / std::pow(kLength_m, 4));
  std::array<double, 3> frequencies, errors;
  for (size_t k = 0; k < 3; ++k) {
    frequencies[k] = SlowestVibration(GridStrip((8u << k) + 2, 3).chain).frequency_per_s;
    errors[k] = std::abs(frequencies[k] - exact);
  }
  ExpectOrder(errors, 1, 1e-9);
  ExpectLimit(frequencies, 1, exact, 1e-9, "frequency");
}

}  // namespace

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Bending);

}  // namespace drape::test
