// OBJ and PLY, as text and as the readers of other programs see them; numbered series.
#include "client/cli/geometry_writer.h"

#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <tiny_obj_loader.h>

#include <assimp/Importer.hpp>
#include <sstream>

#include "tests/client/state_file_test_support.h"

namespace drape::cli {
namespace {

using client_test::kThird;
using client_test::Lines;
using client_test::MakeStates;
using client_test::ReadText;
using client_test::TwoCloths;
using client_test::TwoTopologies;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

using GeometryWriterTest = client_test::StateFileTest;

// Names of the files in `folder`.
std::vector<std::string> Names(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.push_back(entry.path().filename());
  }
  return names;
}

TEST_F(GeometryWriterTest, ObjCountsVerticesThroughTheFile) {
  const auto lines = Lines(ReadText(Written("s.obj")));
  EXPECT_THAT(lines,
              ElementsAre(StartsWith("#"), "o cloth_0", "v 2 3 4", "v 5 0.333333343 7", "v 8 9 10",
                          "f 1 2 3", "o cloth_1", "v 11 12 13", "v 14 15 16", "l 4 5"));
}

TEST_F(GeometryWriterTest, WithoutTopologyObjHasPoints) {
  const auto writer = MakeObjWriter(folder_ / "p.obj", {});
  writer->Add(TwoCloths(0));
  writer->Finish();
  const std::string text = ReadText(folder_ / "p.obj");
  EXPECT_THAT(text, HasSubstr("\np 1\np 2\np 3\no cloth_1\n"));
  EXPECT_THAT(text, HasSubstr("\np 4\np 5\n"));
}

TEST_F(GeometryWriterTest, TinyObjLoaderReadsTheObj) {
  tinyobj::ObjReaderConfig config;
  config.triangulate = false;
  tinyobj::ObjReader reader;
  ASSERT_TRUE(reader.ParseFromFile(Written("s.obj"), config)) << reader.Error();
  EXPECT_EQ(reader.Warning(), "");
  EXPECT_THAT(reader.GetAttrib().vertices,
              ElementsAre(2, 3, 4, 5, kThird, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16));
  const auto& shapes = reader.GetShapes();
  ASSERT_EQ(shapes.size(), 2u);
  EXPECT_EQ(shapes[0].name, "cloth_0");
  ASSERT_EQ(shapes[0].mesh.indices.size(), 3u);
  EXPECT_EQ(shapes[0].mesh.indices[2].vertex_index, 2);
  EXPECT_EQ(shapes[1].name, "cloth_1");
  ASSERT_EQ(shapes[1].lines.indices.size(), 2u);
  EXPECT_EQ(shapes[1].lines.indices[0].vertex_index, 3);
  EXPECT_EQ(shapes[1].lines.indices[1].vertex_index, 4);
}

// The corners of all triangles that assimp finds, in their order.
std::vector<aiVector3D> TrianglesByAssimp(const std::filesystem::path& path) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path, 0);
  EXPECT_NE(scene, nullptr) << importer.GetErrorString();
  if (scene == nullptr) return {};
  std::vector<aiVector3D> corners;
  for (const aiMesh* mesh : std::span(scene->mMeshes, scene->mNumMeshes)) {
    for (const aiFace& face : std::span(mesh->mFaces, mesh->mNumFaces)) {
      if (face.mNumIndices != 3) continue;
      for (const unsigned index : std::span(face.mIndices, 3)) {
        corners.push_back(mesh->mVertices[index]);
      }
    }
  }
  return corners;
}

TEST_F(GeometryWriterTest, AssimpFindsTheTriangleInBoth) {
  for (const char* name : {"s.obj", "s.ply"}) {
    const std::vector<aiVector3D> corners = TrianglesByAssimp(Written(name));
    EXPECT_THAT(corners,
                ElementsAre(aiVector3D(2, 3, 4), aiVector3D(5, kThird, 7), aiVector3D(8, 9, 10)))
        << name;
  }
}

TEST_F(GeometryWriterTest, PlyHasWhatItsHeaderSays) {
  std::istringstream file(ReadText(Written("s.ply")));
  std::vector<std::string> header;
  for (std::string line; std::getline(file, line) && line != "end_header";) header.push_back(line);
  EXPECT_THAT(header, ElementsAre("ply", "format ascii 1.0", StartsWith("comment"),
                                  "element vertex 5", "property float x", "property float y",
                                  "property float z", "property uint cloth", "property float vx",
                                  "property float vy", "property float vz", "element face 1",
                                  "property list uchar uint vertex_indices", "element edge 1",
                                  "property uint vertex1", "property uint vertex2"));
  std::vector<std::string> body;
  for (std::string line; std::getline(file, line);) body.push_back(line);
  EXPECT_THAT(body, ElementsAre("2 3 4 0 0.5 0.5 0.5", "5 0.333333343 7 0 0.5 0.5 0.5",
                                "8 9 10 0 0.5 0.5 0.5", "11 12 13 1 0.5 0.5 0.5",
                                "14 15 16 1 0.5 0.5 -9.99999968e-21", "3 0 1 2", "3 4"));
}

TEST_F(GeometryWriterTest, StatesWithoutVelocitiesGiveAPlyWithout) {
  const auto writer = MakePlyWriter(folder_ / "s.ply", {});
  writer->Add(MakeStates<float>({1}, 1, {1, 2, 3}, {}));
  writer->Finish();
  EXPECT_THAT(
      ReadText(folder_ / "s.ply"),
      ::testing::EndsWith("property uint cloth\nelement face 0\n"
                          "property list uchar uint vertex_indices\nend_header\n1 2 3 0\n"));
}

TEST_F(GeometryWriterTest, DoublesKeepTheirDigits) {
  for (const char* name : {"d.obj", "d.ply"}) {
    const auto writer = MakeStateWriter(folder_ / name, {});
    writer->Add(MakeStates<double>({1}, 1, {0.1, 2, 3}, {1.0 / 3, 0, 0}));
    writer->Finish();
    EXPECT_THAT(ReadText(folder_ / name), HasSubstr("0.10000000000000001 2 3"));
  }
  EXPECT_THAT(ReadText(folder_ / "d.ply"), HasSubstr("property double vx\n"));
  EXPECT_THAT(ReadText(folder_ / "d.ply"), HasSubstr(" 0 0.33333333333333331 0 0\n"));
}

TEST_F(GeometryWriterTest, ASeriesIsAFilePerSample) {
  const auto writer = MakeObjWriter(folder_ / "s.obj", {TwoTopologies(), 0.1, /*is_series=*/true});
  EXPECT_TRUE(writer->takes_samples());
  EXPECT_TRUE(Names(folder_.path()).empty()) << "nothing but files of samples";
  writer->Add(TwoCloths(2), SampleTime{2, 0.2});
  EXPECT_THAT(Names(folder_.path()), ElementsAre("s_000002.obj"));
  writer->Add(TwoCloths(2), SampleTime{5, 0.5});  // of a run whose cloths have stopped
  writer->Finish();
  EXPECT_THAT(Names(folder_.path()), UnorderedElementsAre("s_000002.obj", "s_000005.obj"));
  Written("one.obj");
  EXPECT_EQ(ReadText(folder_ / "s_000002.obj"), ReadText(folder_ / "one.obj"));
  EXPECT_EQ(ReadText(folder_ / "s_000005.obj"), ReadText(folder_ / "one.obj"));
}

}  // namespace
}  // namespace drape::cli
