// The structs of shaders/interface have the same layout for the C++ compiler and for the driver.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <map>
#include <memory>
#include <ostream>
#include <string>

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

// A struct as the host has it.
struct HostStruct {
  std::string file;
  std::string name;
  size_t size_bytes = 0;
};
void PrintTo(const HostStruct& host, std::ostream* stream) {
  *stream << host.name;
}

struct DriverLayout {
  std::map<GLint, GLint> members;  // size by offset [bytes]
  GLint stride = 0;                // of an array of them
};

GLint SizeOf(GLint type) {
  switch (type) {
    case GL_FLOAT:
    case GL_UNSIGNED_INT:
      return 4;
    case GL_FLOAT_VEC4:
      return 16;
    case GL_FLOAT_MAT4:
      return 64;
    default:
      ADD_FAILURE() << "a type that structs of interface/ do not have: " << type;
      return 0;
  }
}

// The driver's layout of the struct as element of a storage block.
DriverLayout AskDriver(const HostStruct& host) {
  gl::ShaderLibrary library;
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    library.Add(std::string(shader.path), std::string(shader.text));
  }
  library.Add("kernels/probe.comp", "#include \"interface/" + host.file +
                                        "\"\n"
                                        "layout(local_size_x = 1) in;\n"
                                        "layout(std430, binding = 0) buffer Block { " +
                                        host.name +
                                        " elements[]; };\n"
                                        "void main() { elements[0] = elements[1]; }\n");
  const Result<gl::ShaderSource> source = library.Assemble("kernels/probe.comp", "");
  DRAPE_CHECK(source.ok(), source.status().ToString());
  const Result<gl::Program> program = gl::Program::Compile(source.value());
  DRAPE_CHECK(program.ok(), program.status().ToString());

  DriverLayout layout;
  const GLuint name = program->name();
  GLint count = 0;
  glGetProgramInterfaceiv(name, GL_BUFFER_VARIABLE, GL_ACTIVE_RESOURCES, &count);
  for (GLint index = 0; index < count; ++index) {
    const GLenum properties[] = {GL_OFFSET, GL_TYPE, GL_ARRAY_SIZE, GL_TOP_LEVEL_ARRAY_STRIDE};
    GLint values[4] = {};
    glGetProgramResourceiv(name, GL_BUFFER_VARIABLE, static_cast<GLuint>(index), 4, properties, 4,
                           nullptr, values);
    layout.members[values[0]] = SizeOf(values[1]) * values[2];
    layout.stride = values[3];
  }
  return layout;
}

class InterfaceLayoutTest : public testing::TestWithParam<HostStruct> {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<gl::Context>> context = gl::Context::Create({});
    ASSERT_TRUE(context.ok()) << context.status().ToString();
    context_ = std::move(context).value();
  }

 private:
  std::unique_ptr<gl::Context> context_;
};

#define HOST_STRUCT(file, name)       \
  HostStruct {                        \
    file, #name, sizeof(shader::name) \
  }

INSTANTIATE_TEST_SUITE_P(
    All, InterfaceLayoutTest,
    testing::Values(
        HOST_STRUCT("batch_item.h", BatchItem), HOST_STRUCT("batch_item.h", PackItem),
        HOST_STRUCT("cloth_record.h", ClothRecord), HOST_STRUCT("cloth_record.h", StepNumbers),
        HOST_STRUCT("cloth_status.h", ClothStatus), HOST_STRUCT("dispatch_args.h", DispatchArgs),
        HOST_STRUCT("layouts.h", ModelLayout), HOST_STRUCT("layouts.h", ParameterLayout),
        HOST_STRUCT("layouts.h", ScratchLayout), HOST_STRUCT("substep_record.h", SubstepRecord),
        HOST_STRUCT("draw_records.h", DrawFrame), HOST_STRUCT("draw_records.h", DrawReaches),
        HOST_STRUCT("draw_records.h", DrawRecord), HOST_STRUCT("draw_records.h", ClothExtents),
        HOST_STRUCT("draw_records.h", SolidRecord), HOST_STRUCT("draw_records.h", PlaneRecord),
        HOST_STRUCT("draw_records.h", LabelRecord)),
    [](const testing::TestParamInfo<HostStruct>& host) { return host.param.name; });

// Both compilers read the same text, so members have the same order and types. Without holes
// between them they have the same offsets, too. Uniform blocks have the layout std140, not std430,
// which AskDriver asks for: the same for structs whose members are multiples of 16 bytes.
TEST_P(InterfaceLayoutTest, NoHolesAndTheSizeThatTheHostHas) {
  const DriverLayout driver = AskDriver(GetParam());
  ASSERT_FALSE(driver.members.empty());
  GLint end = 0;
  for (const auto& [offset, size] : driver.members) {
    EXPECT_EQ(offset, end) << "a hole before it";
    end = offset + size;
  }
  EXPECT_EQ(driver.stride, static_cast<GLint>(GetParam().size_bytes));
}

}  // namespace
}  // namespace drape
