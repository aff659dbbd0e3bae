// The structs of shaders/interface have the same layout for the C++ compiler and for the driver.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "server/gl/context.h"
#include "server/gl/program.h"
#include "server/gl/shader_source.h"
#include "shaders/embedded_shaders.h"
#include "shaders/interface/batch_item.h"
#include "shaders/interface/cloth_record.h"
#include "shaders/interface/cloth_status.h"
#include "shaders/interface/dispatch_args.h"
#include "shaders/interface/draw_records.h"

namespace drape {
namespace {

struct StructLayout {
  std::map<std::string, GLint> offsets;  // by member
  GLint stride = 0;                      // of an array of them
};

// The driver's layout of `struct_name` of interface/`file` as element of a storage block.
StructLayout AskDriver(const std::string& file, const std::string& struct_name) {
  gl::ShaderLibrary library;
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    library.Add(std::string(shader.path), std::string(shader.text));
  }
  library.Add("kernels/probe.comp", "#include \"interface/" + file +
                                        "\"\n"
                                        "layout(local_size_x = 1) in;\n"
                                        "layout(std430, binding = 0) buffer Block { " +
                                        struct_name +
                                        " elements[]; };\n"
                                        "void main() { elements[0] = elements[1]; }\n");
  const Result<gl::ShaderSource> source = library.Assemble("kernels/probe.comp", "");
  DRAPE_CHECK(source.ok(), source.status().ToString());
  const Result<gl::Program> program = gl::Program::Compile(source.value());
  DRAPE_CHECK(program.ok(), program.status().ToString());

  StructLayout layout;
  const GLuint name = program->name();
  GLint count = 0;
  glGetProgramInterfaceiv(name, GL_BUFFER_VARIABLE, GL_ACTIVE_RESOURCES, &count);
  for (GLint index = 0; index < count; ++index) {
    char text[256] = {};
    const auto resource = static_cast<GLuint>(index);
    glGetProgramResourceName(name, GL_BUFFER_VARIABLE, resource, sizeof(text), nullptr, text);
    const GLenum properties[] = {GL_OFFSET, GL_TOP_LEVEL_ARRAY_STRIDE};
    GLint values[2] = {};
    glGetProgramResourceiv(name, GL_BUFFER_VARIABLE, resource, 2, properties, 2, nullptr, values);
    const std::string prefix = "elements[0].";
    EXPECT_EQ(std::string(text).substr(0, prefix.size()), prefix);
    layout.offsets[std::string(text).substr(prefix.size())] = values[0];
    layout.stride = values[1];
  }
  return layout;
}

class InterfaceLayoutTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<gl::Context>> context = gl::Context::Create({});
    ASSERT_TRUE(context.ok()) << context.status().ToString();
    context_ = std::move(context).value();
  }

 private:
  std::unique_ptr<gl::Context> context_;
};

#define MEMBER(type, member) \
  { #member, static_cast < GLint>(offsetof(shader::type, member)) }

TEST_F(InterfaceLayoutTest, ClothRecord) {
  const std::map<std::string, GLint> expected = {
      MEMBER(ClothRecord, gravity),
      MEMBER(ClothRecord, particle_count),
      MEMBER(ClothRecord, constraint_count),
      MEMBER(ClothRecord, colour_count),
      MEMBER(ClothRecord, pin_count),
      MEMBER(ClothRecord, collider_count),
      MEMBER(ClothRecord, has_springs),
      MEMBER(ClothRecord, has_compliance),
      MEMBER(ClothRecord, substeps),
      MEMBER(ClothRecord, max_iterations),
      MEMBER(ClothRecord, h),
      MEMBER(ClothRecord, half_h),
      MEMBER(ClothRecord, inverse_h),
      MEMBER(ClothRecord, tolerance),
      MEMBER(ClothRecord, contact_tolerance),
      MEMBER(ClothRecord, max_depenetration),
      MEMBER(ClothRecord, thickness),
      MEMBER(ClothRecord, friction_static),
      MEMBER(ClothRecord, friction_dynamic),
      MEMBER(ClothRecord, first_kick),
      MEMBER(ClothRecord, contact_margin),
      MEMBER(ClothRecord, is_tiled),
      MEMBER(ClothRecord, sweep_cost),
      MEMBER(ClothRecord, substep_cost),
      MEMBER(ClothRecord, fixed_cost),
      MEMBER(ClothRecord, colour_offsets),
      MEMBER(ClothRecord, pairs),
      MEMBER(ClothRecord, rest_lengths),
      MEMBER(ClothRecord, compliances),
      MEMBER(ClothRecord, masses),
      MEMBER(ClothRecord, inverse_masses),
      MEMBER(ClothRecord, spring_offsets),
      MEMBER(ClothRecord, spring_ends),
      MEMBER(ClothRecord, pins),
      MEMBER(ClothRecord, positions),
      MEMBER(ClothRecord, velocities),
      MEMBER(ClothRecord, pin_targets),
      MEMBER(ClothRecord, colliders),
      MEMBER(ClothRecord, lambdas),
      MEMBER(ClothRecord, normal_betas),
      MEMBER(ClothRecord, tangent_betas),
      MEMBER(ClothRecord, spring_accelerations),
      MEMBER(ClothRecord, work_positions),
      MEMBER(ClothRecord, work_velocities),
      MEMBER(ClothRecord, violations),
      MEMBER(ClothRecord, measured_pieces),
      MEMBER(ClothRecord, measure_piece_count),
      MEMBER(ClothRecord, tether_offsets),
      MEMBER(ClothRecord, tethers),
      MEMBER(ClothRecord, intervals),
      MEMBER(ClothRecord, inverse_intervals),
      MEMBER(ClothRecord, damping_factors),
      MEMBER(ClothRecord, inverse_durations),
      MEMBER(ClothRecord, last_inverse_interval),
      MEMBER(ClothRecord, twist_share),
      MEMBER(ClothRecord, twist_period),
      MEMBER(ClothRecord, twist_changes),
      MEMBER(ClothRecord, grid_columns),
      MEMBER(ClothRecord, grid_rows),
      MEMBER(ClothRecord, previous_positions),
      MEMBER(ClothRecord, previous_velocities),
      MEMBER(ClothRecord, strip_phase_count),
      MEMBER(ClothRecord, strip_phases),
      MEMBER(ClothRecord, strip_offsets),
      MEMBER(ClothRecord, strip_constraints),
      MEMBER(ClothRecord, strip_particles),
      MEMBER(ClothRecord, strip_links),
      MEMBER(ClothRecord, end_share),
      MEMBER(ClothRecord, velocity_iterations),
      MEMBER(ClothRecord, wind),
      MEMBER(ClothRecord, triangle_count),
      MEMBER(ClothRecord, air_drag),
      MEMBER(ClothRecord, air_lift),
      MEMBER(ClothRecord, air_impulses),
      MEMBER(ClothRecord, triangles),
      MEMBER(ClothRecord, triangle_masses),
      MEMBER(ClothRecord, triangle_offsets),
      MEMBER(ClothRecord, particle_triangles),
      MEMBER(ClothRecord, joint_count),
      MEMBER(ClothRecord, joint_colour_count),
      MEMBER(ClothRecord, has_joint_compliance),
      MEMBER(ClothRecord, has_inequalities),
      MEMBER(ClothRecord, joint_colour_offsets),
      MEMBER(ClothRecord, joint_pairs),
      MEMBER(ClothRecord, joint_compliances),
      MEMBER(ClothRecord, kinds),
      MEMBER(ClothRecord, joint_lambdas),
      MEMBER(ClothRecord, has_own_lengths),
      MEMBER(ClothRecord, length_starts),
      MEMBER(ClothRecord, length_targets),
      MEMBER(ClothRecord, restitution),
      MEMBER(ClothRecord, slowest_rebound),
      MEMBER(ClothRecord, rebounds),
      MEMBER(ClothRecord, collider_motions),
      MEMBER(ClothRecord, elastic_count),
      MEMBER(ClothRecord, elastic_elements),
      MEMBER(ClothRecord, elastic_offsets),
      MEMBER(ClothRecord, elastic_ends),
      MEMBER(ClothRecord, elastic_impulses),
      MEMBER(ClothRecord, shortest_sq),
      MEMBER(ClothRecord, longest_sq),
      MEMBER(ClothRecord, refine_rounds),
      MEMBER(ClothRecord, refine_solves),
      MEMBER(ClothRecord, far_off_flags),
      MEMBER(ClothRecord, refined_links),
      MEMBER(ClothRecord, met_colliders),
      MEMBER(ClothRecord, reach_margin),
      MEMBER(ClothRecord, strip_lengths),
      MEMBER(ClothRecord, regular_strips),
      MEMBER(ClothRecord, padding_0),
  };
  const StructLayout driver = AskDriver("cloth_record.h", "ClothRecord");
  EXPECT_EQ(driver.offsets, expected);
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::ClothRecord)));
}

TEST_F(InterfaceLayoutTest, ClothStatus) {
  const std::map<std::string, GLint> expected = {
      MEMBER(ClothStatus, iterations),
      MEMBER(ClothStatus, unconverged_substeps),
      MEMBER(ClothStatus, fault),
      MEMBER(ClothStatus, sweep_changed),
      MEMBER(ClothStatus, is_substep_done),
      MEMBER(ClothStatus, contacts),
      MEMBER(ClothStatus, max_strain),
      MEMBER(ClothStatus, rms_strain),
      MEMBER(ClothStatus, kinetic_energy),
      MEMBER(ClothStatus, potential_energy),
      MEMBER(ClothStatus, strain_energy),
      MEMBER(ClothStatus, lowest),
      MEMBER(ClothStatus, max_penetration),
      MEMBER(ClothStatus, max_residual),
      MEMBER(ClothStatus, next_substep),
      MEMBER(ClothStatus, next_sweep),
      MEMBER(ClothStatus, far_colliders),
      {"range[0]", static_cast<GLint>(offsetof(shader::ClothStatus, range))},
  };
  const StructLayout driver = AskDriver("cloth_status.h", "ClothStatus");
  EXPECT_EQ(driver.offsets, expected);
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::ClothStatus)));
}

TEST_F(InterfaceLayoutTest, BatchItem) {
  const std::map<std::string, GLint> expected = {MEMBER(BatchItem, cloth),
                                                 MEMBER(BatchItem, status)};
  const StructLayout driver = AskDriver("batch_item.h", "BatchItem");
  EXPECT_EQ(driver.offsets, expected);
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::BatchItem)));
}

TEST_F(InterfaceLayoutTest, PackItem) {
  const std::map<std::string, GLint> expected = {MEMBER(PackItem, source), MEMBER(PackItem, target),
                                                 MEMBER(PackItem, count),
                                                 MEMBER(PackItem, padding)};
  const StructLayout driver = AskDriver("batch_item.h", "PackItem");
  EXPECT_EQ(driver.offsets, expected);
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::PackItem)));
}

TEST_F(InterfaceLayoutTest, DispatchArgs) {
  const std::map<std::string, GLint> expected = {
      MEMBER(DispatchArgs, group_count_x), MEMBER(DispatchArgs, group_count_y),
      MEMBER(DispatchArgs, group_count_z), MEMBER(DispatchArgs, active_group_count_y)};
  const StructLayout driver = AskDriver("dispatch_args.h", "DispatchArgs");
  EXPECT_EQ(driver.offsets, expected);
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::DispatchArgs)));
}

// Uniform blocks have the layout std140, storage blocks, which AskDriver asks for, std430: the same
// for structs whose members are multiples of 16 bytes.
TEST_F(InterfaceLayoutTest, DrawFrame) {
  const std::map<std::string, GLint> expected = {
      MEMBER(DrawFrame, clip_from_world), MEMBER(DrawFrame, shadow_from_world),
      MEMBER(DrawFrame, viewer),          MEMBER(DrawFrame, to_light),
      MEMBER(DrawFrame, screen),          MEMBER(DrawFrame, scale)};
  const StructLayout driver = AskDriver("draw_records.h", "DrawFrame");
  EXPECT_EQ(driver.offsets, expected);
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::DrawFrame)));
}

TEST_F(InterfaceLayoutTest, DrawReaches) {
  const StructLayout driver = AskDriver("draw_records.h", "DrawReaches");
  EXPECT_EQ(driver.offsets, (std::map<std::string, GLint>{{"directions[0]", 0}}));
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::DrawReaches)));
}

TEST_F(InterfaceLayoutTest, DrawRecord) {
  const std::map<std::string, GLint> expected = {
      MEMBER(DrawRecord, offset),         MEMBER(DrawRecord, colour),
      MEMBER(DrawRecord, particle_count), MEMBER(DrawRecord, constraint_count),
      MEMBER(DrawRecord, positions),      MEMBER(DrawRecord, velocities),
      MEMBER(DrawRecord, shaded),         MEMBER(DrawRecord, corner_offsets),
      MEMBER(DrawRecord, corners),        MEMBER(DrawRecord, end_offsets),
      MEMBER(DrawRecord, ends),           MEMBER(DrawRecord, constraints),
      MEMBER(DrawRecord, pins),           MEMBER(DrawRecord, pin_count),
      MEMBER(DrawRecord, line_radius),    MEMBER(DrawRecord, ball_radius),
      MEMBER(DrawRecord, pin_radius),     MEMBER(DrawRecord, has_surface)};
  const StructLayout driver = AskDriver("draw_records.h", "DrawRecord");
  EXPECT_EQ(driver.offsets, expected);
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::DrawRecord)));
}

TEST_F(InterfaceLayoutTest, ClothExtents) {
  const std::map<std::string, GLint> expected = {
      MEMBER(ClothExtents, low_x),
      MEMBER(ClothExtents, low_y),
      MEMBER(ClothExtents, low_z),
      MEMBER(ClothExtents, low_value),
      MEMBER(ClothExtents, high_x),
      MEMBER(ClothExtents, high_y),
      MEMBER(ClothExtents, high_z),
      MEMBER(ClothExtents, high_value),
      {"reaches[0]", static_cast<GLint>(offsetof(shader::ClothExtents, reaches))}};
  const StructLayout driver = AskDriver("draw_records.h", "ClothExtents");
  EXPECT_EQ(driver.offsets, expected);
  EXPECT_EQ(driver.stride, static_cast<GLint>(sizeof(shader::ClothExtents)));
}

TEST_F(InterfaceLayoutTest, DrawnThings) {
  const StructLayout solid = AskDriver("draw_records.h", "SolidRecord");
  EXPECT_EQ(solid.offsets,
            (std::map<std::string, GLint>{MEMBER(SolidRecord, center), MEMBER(SolidRecord, axis_x),
                                          MEMBER(SolidRecord, axis_y), MEMBER(SolidRecord, axis_z),
                                          MEMBER(SolidRecord, colour)}));
  EXPECT_EQ(solid.stride, static_cast<GLint>(sizeof(shader::SolidRecord)));
  const StructLayout plane = AskDriver("draw_records.h", "PlaneRecord");
  EXPECT_EQ(plane.offsets, (std::map<std::string, GLint>{
                               MEMBER(PlaneRecord, center), MEMBER(PlaneRecord, tangent),
                               MEMBER(PlaneRecord, bitangent), MEMBER(PlaneRecord, grid)}));
  EXPECT_EQ(plane.stride, static_cast<GLint>(sizeof(shader::PlaneRecord)));
  const StructLayout label = AskDriver("draw_records.h", "LabelRecord");
  EXPECT_EQ(label.offsets,
            (std::map<std::string, GLint>{
                MEMBER(LabelRecord, box), MEMBER(LabelRecord, texture), MEMBER(LabelRecord, colour),
                MEMBER(LabelRecord, kind), MEMBER(LabelRecord, corner_radius),
                MEMBER(LabelRecord, padding0), MEMBER(LabelRecord, padding1)}));
  EXPECT_EQ(label.stride, static_cast<GLint>(sizeof(shader::LabelRecord)));
}

}  // namespace
}  // namespace drape
