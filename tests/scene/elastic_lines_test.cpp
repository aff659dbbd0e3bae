// The lines of elastic elements: their matrices against the elements themselves.
#include "server/scene/elastic_lines.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "server/scene/scene_model.h"

namespace drape {
namespace {

constexpr double kSquaredInterval_s2 = 1e-6;

// A family by its kind, its lines being rows, columns or diagonals, and an element.
bool IsOf(const ElasticFamily& family, const ElasticLine& line, const ElasticElement& element) {
  const auto& [i, j, k, l] = element.particles;
  if (element.weights[3] != 0) return family.kind == ElasticKind::kCells;
  if (element.weights[2] != 0) {
    return family.kind == ElasticKind::kRods && k - i == line.stride;
  }
  return family.kind == ElasticKind::kDiagonals && j - i == line.stride;
}

// The elements of a family: J [element][particle], and their stiffnesses.
struct FamilyElements {
  Eigen::MatrixXd weights;
  Eigen::VectorXd stiffnesses;
  std::vector<uint32_t> first_particles;
};

FamilyElements ElementsOf(const SceneModel& model, const ElasticFamily& family) {
  const ElasticLine& line = model.elastic_lines().lines[family.line_begin];
  std::vector<const ElasticElement*> elements;
  for (const ElasticElement& element : model.elastic_elements()) {
    if (IsOf(family, line, element)) elements.push_back(&element);
  }
  const auto count = static_cast<Eigen::Index>(elements.size());
  FamilyElements found{
      Eigen::MatrixXd::Zero(count, model.particle_count()), Eigen::VectorXd::Zero(count), {}};
  for (Eigen::Index e = 0; e < count; ++e) {
    for (size_t k = 0; k < 4; ++k)
      found.weights(e, elements[e]->particles[k]) += elements[e]->weights[k];
    found.stiffnesses[e] = elements[e]->stiffness_n_per_m;
    found.first_particles.push_back(elements[e]->particles[0]);
  }
  return found;
}

// L D L^T of a family, by the particles of its entries; rows and columns without an entry are 0.
Eigen::MatrixXd MatrixOf(const SceneModel& model, const ElasticFamily& family,
                         const std::vector<ElasticEntry>& entries) {
  Eigen::MatrixXd l = Eigen::MatrixXd::Identity(model.particle_count(), model.particle_count());
  Eigen::VectorXd d = Eigen::VectorXd::Zero(model.particle_count());
  for (uint32_t k = family.line_begin; k < family.line_end; ++k) {
    const ElasticLine& line = model.elastic_lines().lines[k];
    for (uint32_t place = 0; place < line.count; ++place) {
      const ElasticEntry& entry = entries[line.entry_begin + place];
      const uint32_t i = line.first + place * line.stride;
      if (entry.inverse_pivot > 0) d[i] = 1 / entry.inverse_pivot;
      if (place + 1 < line.count) l(i + line.stride, i) = entry.to_next;
      if (place + 2 < line.count) l(i + 2 * line.stride, i) = entry.to_second_next;
    }
  }
  return l * d.asDiagonal() * l.transpose();
}

// Grids of any size with pins anywhere.
std::shared_ptr<const SceneModel> RandomModel(std::mt19937& random) {
  const auto number = [&](uint32_t low, uint32_t high) {
    return std::uniform_int_distribution<uint32_t>(low, high)(random);
  };
  const uint32_t columns = number(1, 7), rows = number(columns == 1 ? 2 : 1, 7);
  ModelDescription description{GridTopology{columns, rows, 0.3, 0.2},
                               {.bending_rigidity_n_m = 1e-3, .shear_modulus_n_per_m = 50},
                               {}};
  for (uint32_t i = 0; i < columns * rows; ++i) {
    if (number(0, 4) == 0) description.pinned_particles.push_back(i);
  }
  return *SceneModel::Build(description);
}

// M + s K, pins left out.
void ExpectRods(const SceneModel& model, const FamilyElements& elements,
                const Eigen::MatrixXd& matrix) {
  const Eigen::MatrixXd stiffness =
      elements.weights.transpose() * elements.stiffnesses.asDiagonal() * elements.weights;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    for (uint32_t j = 0; j < model.particle_count(); ++j) {
      const bool is_free =
          model.inverse_masses_per_kg()[i] > 0 && model.inverse_masses_per_kg()[j] > 0;
      const double mass = i == j ? model.masses_kg()[i] : 0;
      const double expected = is_free ? mass + kSquaredInterval_s2 * stiffness(i, j) : 0;
      EXPECT_NEAR(matrix(i, j), expected, 1e-12);
    }
  }
}

// At least K^-1 + s J W J^T: with it no impulse is too large, whatever others the particles feel.
void ExpectCells(const SceneModel& model, const FamilyElements& elements,
                 const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd w =
      Eigen::VectorXd::Map(model.inverse_masses_per_kg().data(), model.particle_count());
  Eigen::MatrixXd excess =
      -kSquaredInterval_s2 * elements.weights * w.asDiagonal() * elements.weights.transpose();
  for (Eigen::Index a = 0; a < excess.rows(); ++a) {
    excess(a, a) -= 1 / elements.stiffnesses[a];
    for (Eigen::Index b = 0; b < excess.cols(); ++b) {
      excess(a, b) += matrix(elements.first_particles[a], elements.first_particles[b]);
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(excess);
  EXPECT_GE(solver.eigenvalues().minCoeff(), -1e-12 * matrix.norm());
}

// Every element is in one family, which is solved for what its elements are.
TEST(ElasticLinesTest, MatricesAreThoseOfTheElements) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const auto model = RandomModel(random);
    const std::vector<ElasticEntry> entries =
        DecomposeElasticLines(model->elastic_lines(), model->inverse_masses_per_kg(),
                              model->grid_columns(), kSquaredInterval_s2);
    Eigen::Index element_count = 0;
    for (const ElasticFamily& family : model->elastic_lines().families) {
      if (family.line_begin == family.line_end) continue;
      const FamilyElements elements = ElementsOf(*model, family);
      element_count += elements.stiffnesses.size();
      if (elements.stiffnesses.size() == 0) continue;
      const Eigen::MatrixXd matrix = MatrixOf(*model, family, entries);
      if (family.kind == ElasticKind::kRods) ExpectRods(*model, elements, matrix);
      if (family.kind == ElasticKind::kCells) ExpectCells(*model, elements, matrix);
      if (family.kind != ElasticKind::kDiagonals) continue;
      for (uint32_t k = family.line_begin; k < family.line_end; ++k) {
        const ElasticLine& line = model->elastic_lines().lines[k];
        for (uint32_t i = line.entry_begin; i + 1 < line.entry_begin + line.count; ++i) {
          EXPECT_EQ(entries[i].elasticity, 1 / model->elastic_lines().stiffnesses_n_per_m[i]);
        }
      }
    }
    EXPECT_EQ(element_count, static_cast<Eigen::Index>(model->elastic_elements().size()));
  }
}

// What no substep and no single precision can tell from a rigid cloth is softened to that.
TEST(ElasticLinesTest, AbsurdStiffnessIsLimited) {
  const auto model =
      *SceneModel::Build({GridTopology{5, 4, 0.4, 0.3},
                          {.bending_rigidity_n_m = 1e6, .shear_modulus_n_per_m = 1e15},
                          {}});
  const ElasticLines& lines = model->elastic_lines();
  const double mass_kg = model->masses_kg()[0];
  for (const double s_s2 : {1e-6, 1e-4}) {
    const auto entries =
        DecomposeElasticLines(lines, model->inverse_masses_per_kg(), model->grid_columns(), s_s2);
    for (const ElasticFamily& family : lines.families) {
      const ElasticLine& line = lines.lines[family.line_begin];
      const ElasticEntry& entry = entries[line.entry_begin + 1];
      switch (family.kind) {
        case ElasticKind::kRods:
          EXPECT_GT(entry.elasticity, 0);
          EXPECT_LE(5 * s_s2 * entry.elasticity / mass_kg, kMaxLineRatio * (1 + 1e-9));
          break;
        case ElasticKind::kDiagonals:
          EXPECT_LE(2 * s_s2 / mass_kg / entries[line.entry_begin].elasticity,
                    kMaxLineRatio * (1 + 1e-9));
          break;
        case ElasticKind::kCells:
          EXPECT_LE(8 * s_s2 / mass_kg * entry.inverse_pivot, kMaxLineRatio * (1 + 1e-9));
          break;
      }
    }
  }
}

}  // namespace
}  // namespace drape
