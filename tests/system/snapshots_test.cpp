// Saved cloths as bytes: cloths made of them go on with the same bits, here and on another server,
// and nothing that is not such bytes harms a server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "drape/v1/snapshot_file.pb.h"
#include "server/api/snapshot_records.h"
#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"
#include "tests/system/random_traffic.h"

namespace drape::test {
namespace {

using testing::HasSubstr;

// A server and a session of it.
struct Side {
  explicit Side(const std::string& backend) : server(backend) {}
  InProcessServer server;
  std::unique_ptr<Stub> stub = server.NewStub();
  std::string session = NewSession(*stub);
};

void Save(Side& side, const std::string& name, const Ids& ids) {
  v1::SaveStatesRequest request;
  request.set_session(side.session);
  request.set_name(name);
  for (const uint64_t id : ids) request.add_cloth_ids(id);
  ASSERT_TRUE(Call(*side.stub, &Stub::SaveStates, request).status.ok());
}

Answer<std::string> Export(Side& side, const std::string& name, uint64_t offset = 0) {
  v1::ExportClothsRequest request;
  request.set_session(side.session);
  request.set_name(name);
  request.set_offset(offset);
  grpc::ClientContext context;
  const auto stream = side.stub->ExportCloths(&context, request);
  Answer<std::string> answer;
  v1::SnapshotChunk chunk;
  while (stream->Read(&chunk)) {
    EXPECT_EQ(chunk.offset(), offset + answer.value.size());
    answer.value += chunk.data();
    EXPECT_LE(offset + answer.value.size(), chunk.total_bytes());
  }
  answer.status = stream->Finish();
  return answer;
}

// Announces `total_bytes`, or as many as there are.
Answer<v1::ImportClothsResponse> Import(Side& side, const std::string& bytes, bool inexact = false,
                                        uint64_t total_bytes = 0,
                                        const std::string& request_id = {}) {
  grpc::ClientContext context;
  Answer<v1::ImportClothsResponse> answer;
  const auto stream = side.stub->ImportCloths(&context, &answer.value);
  v1::ImportClothsRequest request;
  request.mutable_begin()->set_session(side.session);
  request.mutable_begin()->set_inexact(inexact);
  request.mutable_begin()->set_total_bytes(total_bytes > 0 ? total_bytes : bytes.size());
  request.mutable_begin()->set_request_id(request_id);
  stream->Write(request);
  constexpr size_t kPiece = 100'000;
  for (size_t begin = 0; begin < bytes.size(); begin += kPiece) {
    request.set_data(bytes.substr(begin, kPiece));
    if (!stream->Write(request)) break;
  }
  stream->WritesDone();
  answer.status = stream->Finish();
  return answer;
}

Ids IdsOf(const Answer<v1::ImportClothsResponse>& answer) {
  EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
  return {answer.value.cloth_ids().begin(), answer.value.cloth_ids().end()};
}

void Delete(Side& side, const Ids& ids) {
  v1::DeleteClothsRequest deletion;
  deletion.set_session(side.session);
  for (const uint64_t id : ids) deletion.add_cloth_ids(id);
  ASSERT_TRUE(Call(*side.stub, &Stub::DeleteCloths, deletion).status.ok());
}

void Reset(Side& side, const Ids& ids) {
  v1::ResetClothsRequest reset;
  reset.set_session(side.session);
  for (const uint64_t id : ids) reset.add_cloth_ids(id);
  ASSERT_TRUE(Call(*side.stub, &Stub::ResetCloths, reset).status.ok());
}

// What a client sees of the cloth besides its id: bits, step, time, settings, poses of colliders.
std::string Seen(Side& side, uint64_t id) {
  v1::Cloth cloth = Get(*side.stub, side.session, id);
  cloth.clear_id();
  return Bits(*side.stub, side.session, {id}) + cloth.DebugString();
}

// The part of the request that is about `cloth`, asked of `instead`; gives back the reports.
std::string StepOne(Side& side, v1::StepRequest request, uint64_t cloth, uint64_t instead) {
  request = RandomTraffic::OnlyFor(request, cloth, instead);
  request.set_session(side.session);
  v1::StepResponse answer = Step(*side.stub, request);
  std::string text;
  for (v1::StepReport& report : *answer.mutable_reports()) {
    report.clear_cloth_id();
    text += report.DebugString();
  }
  return text;
}

class Snapshots : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, Snapshots, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

// What it touches as it sleeps it tells elsewhere, too, without being woken.
TEST_P(Snapshots, ASheetAsleepKeepsItsContacts) {
  Side here(GetParam()), there(GetParam());
  v1::CreateClothsRequest creation = HangingSheet(here.session, 5, 1);
  creation.mutable_spec()->clear_pins();
  v1::Plane& table =
      *creation.mutable_spec()->mutable_environment()->add_colliders()->mutable_plane();
  for (const double x : {0.0, 0.0, 0.0}) table.add_point_m(x);
  for (const double x : {0.0, 1.0, 0.0}) table.add_normal(x);
  const Ids ids = Create(*here.stub, creation);
  const auto asking = [](Side& side, const Ids& cloths) {
    v1::StepRequest request = StepsOf(side.session, cloths, 1);
    request.set_contact_impulses(true);
    request.set_report(true);
    return request;
  };
  bool is_asleep = false;
  for (int step = 0; step < 600 && !is_asleep; ++step) {
    is_asleep = Step(*here.stub, asking(here, ids)).reports(0).asleep();
  }
  ASSERT_TRUE(is_asleep);
  Save(here, "asleep", ids);
  const Ids others = IdsOf(Import(there, Export(here, "asleep").value));
  const v1::StepResponse expected = Step(*here.stub, asking(here, ids));
  const v1::StepResponse actual = Step(*there.stub, asking(there, others));
  EXPECT_TRUE(actual.reports(0).asleep());
  EXPECT_EQ(actual.contact_impulses().particles_size(), 25);
  EXPECT_EQ(std::vector<double>(actual.contact_impulses().impulses_n_s().begin(),
                                actual.contact_impulses().impulses_n_s().end()),
            std::vector<double>(expected.contact_impulses().impulses_n_s().begin(),
                                expected.contact_impulses().impulses_n_s().end()));
}

void ExpectGoingOnElsewhere(const std::string& backend, uint32_t first_seed, uint32_t seeds) {
  Side here(backend), there(backend);
  for (uint32_t seed = first_seed; seed < first_seed + seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomTraffic traffic(seed, backend != "gl");
    const Ids ids = Create(*here.stub, traffic.Creation(here.session));
    for (uint32_t k = 0; k < 4; ++k) Step(*here.stub, traffic.Steps(here.session, ids));
    // Parameters, pins and models that are not those of the creation.
    if (seed % 2 == 1) traffic.Disturb(*here.stub, here.session, ids);
    // The pins may be others then, and are not moved.
    const auto steps = [&] {
      v1::StepRequest request = traffic.Steps(here.session, ids);
      if (seed % 2 == 1) request.clear_pin_controls();
      return request;
    };
    for (uint32_t k = 0; k < 2; ++k) Step(*here.stub, steps());
    const std::string name = std::to_string(seed);
    ASSERT_NO_FATAL_FAILURE(Save(here, name, ids));
    const auto bytes = Export(here, name);
    ASSERT_TRUE(bytes.status.ok()) << bytes.status.error_message();

    const Ids others = IdsOf(Import(there, bytes.value));
    const Ids copies = IdsOf(Import(here, bytes.value));
    ASSERT_EQ(others.size(), ids.size());
    ASSERT_EQ(copies.size(), ids.size());
    for (uint32_t k = 0; k < 5; ++k) {
      SCOPED_TRACE("request " + std::to_string(k));
      const v1::StepRequest request = steps();
      for (size_t c = 0; c < ids.size(); ++c) {
        const std::string reports = StepOne(here, request, ids[c], ids[c]);
        ASSERT_EQ(StepOne(there, request, ids[c], others[c]), reports);
        ASSERT_EQ(StepOne(here, request, ids[c], copies[c]), reports);
        const std::string seen = Seen(here, ids[c]);
        ASSERT_TRUE(Seen(there, others[c]) == seen);
        ASSERT_TRUE(Seen(here, copies[c]) == seen);
      }
      // From the start again, with the controls of nobody.
      if (k != 3) continue;
      ASSERT_NO_FATAL_FAILURE(Reset(here, ids));
      ASSERT_NO_FATAL_FAILURE(Reset(here, copies));
      ASSERT_NO_FATAL_FAILURE(Reset(there, others));
    }
    ASSERT_NO_FATAL_FAILURE(Delete(here, ids));
    ASSERT_NO_FATAL_FAILURE(Delete(here, copies));
    ASSERT_NO_FATAL_FAILURE(Delete(there, others));
  }
}

// Each kind of scene once, of gl the first three (as in saved_states_test.cpp).
TEST_P(Snapshots, RandomScenesGoOnElsewhereWithTheSameBits) {
  ExpectGoingOnElsewhere(GetParam(), 0, GetParam() == "gl" ? 3 : 8);
}

using SnapshotsLong = Snapshots;
INSTANTIATE_TEST_SUITE_P(Backends, SnapshotsLong, testing::ValuesIn(BackendNames()),
                         [](const auto& test) { return test.param; });

TEST_P(SnapshotsLong, MoreRandomScenesGoOnElsewhereWithTheSameBits) {
  const bool is_gl = GetParam() == "gl";
  ExpectGoingOnElsewhere(GetParam(), is_gl ? 3 : 8, is_gl ? 5 : 16);
}

// Pins pull sheets through themselves (not on gl, where that takes llvmpipe minutes): what crosses,
// and was not looked for, is part of the state.
TEST_P(Snapshots, SheetsThatCrossThemselvesGoOnWithTheSameBits) {
  Side side(GetParam());
  constexpr uint32_t kTouchesItself = 3;
  RandomTraffic traffic(kTouchesItself, GetParam() != "gl");
  const Ids ids = Create(*side.stub, traffic.Creation(side.session));
  for (uint32_t k = 0; k < 3; ++k) Step(*side.stub, traffic.Steps(side.session, ids));
  for (uint32_t k = 0; k < 16; ++k) {
    SCOPED_TRACE("step " + std::to_string(k));
    ASSERT_NO_FATAL_FAILURE(Save(side, "a", ids));
    const Ids copies = IdsOf(Import(side, Export(side, "a").value));
    ASSERT_EQ(copies.size(), ids.size());
    Step(*side.stub, StepsOf(side.session, ids, 1));
    Step(*side.stub, StepsOf(side.session, copies, 1));
    ASSERT_TRUE(Bits(*side.stub, side.session, copies) == Bits(*side.stub, side.session, ids));
    ASSERT_NO_FATAL_FAILURE(Delete(side, copies));
  }
}

// Sheets around a sphere, which start beside it.
TEST_P(Snapshots, ClothsThatWereClearedOfCollidersStartThereAgain) {
  Side here(GetParam()), there(GetParam());
  v1::CreateClothsRequest creation = HangingSheet(here.session, 6);
  creation.mutable_spec()->clear_pins();
  auto* environment = creation.mutable_spec()->mutable_environment();
  v1::Sphere* sphere = environment->add_colliders()->mutable_sphere();
  const v1::Grid& grid = creation.spec().grid();
  Set(sphere->mutable_center_m(), {grid.width_m() / 2, 0, grid.height_m() / 2});
  sphere->set_radius_m(grid.width_m() / 3);
  const auto created = Call(*here.stub, &Stub::CreateCloths, creation);
  ASSERT_TRUE(created.status.ok()) << created.status.error_message();
  ASSERT_TRUE(created.value.shape().has_start_correction());
  const uint64_t id = created.value.cloth_ids(0);
  Step(*here.stub, StepsOf(here.session, {id}, 3));
  ASSERT_NO_FATAL_FAILURE(Save(here, "a", {id}));
  const Ids others = IdsOf(Import(there, Export(here, "a").value));
  ASSERT_EQ(others.size(), 1u);
  EXPECT_TRUE(Seen(there, others[0]) == Seen(here, id));
  ASSERT_NO_FATAL_FAILURE(Reset(here, {id}));
  ASSERT_NO_FATAL_FAILURE(Reset(there, others));
  EXPECT_TRUE(Seen(there, others[0]) == Seen(here, id));
}

class SnapshotBytes : public testing::Test {
 protected:
  void SetUp() override {
    v1::CreateClothsRequest creation = HangingSheet(side_.session, 4, 2);
    creation.mutable_spec()->set_max_grips(1);
    ids_ = Create(*side_.stub, creation);
    Step(*side_.stub, StepsOf(side_.session, ids_, 2));
    ASSERT_NO_FATAL_FAILURE(Save(side_, "a", ids_));
    const auto exported = Export(side_, "a");
    ASSERT_TRUE(exported.status.ok()) << exported.status.error_message();
    bytes_ = exported.value;
  }

  Side side_{"cpu"};
  Ids ids_;
  std::string bytes_;
};

TEST_F(SnapshotBytes, AnExportGoesOnWhereItWasCut) {
  EXPECT_EQ(Export(side_, "a").value, bytes_);
  for (const uint64_t offset : {uint64_t{1}, uint64_t{1000}, uint64_t{bytes_.size()}}) {
    const auto rest = Export(side_, "a", offset);
    EXPECT_TRUE(rest.status.ok());
    EXPECT_EQ(rest.value, bytes_.substr(offset));
  }
  EXPECT_EQ(FieldsOf(Export(side_, "a", bytes_.size() + 1).status),
            std::vector<std::string>{"offset"});
  EXPECT_EQ(ReasonOf(Export(side_, "b").status), "SAVED_STATES_NOT_FOUND");
}

TEST_F(SnapshotBytes, EveryFlippedBitIsNoticed) {
  std::mt19937 random(1);
  for (uint32_t k = 0; k < 1000; ++k) {
    std::string flipped = bytes_;
    const size_t bit = random() % (8 * bytes_.size());
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
    const auto answer = Import(side_, flipped);
    ASSERT_EQ(ReasonOf(answer.status), "SNAPSHOT_DAMAGED")
        << "bit " << bit << ": " << answer.status.error_message();
  }
}

TEST_F(SnapshotBytes, WhatIsCutOffOrTooMuchIsNoticed) {
  for (size_t size = 1; size < bytes_.size(); size += 97) {
    const auto answer = Import(side_, bytes_.substr(0, size));
    ASSERT_EQ(ReasonOf(answer.status), "SNAPSHOT_DAMAGED") << size;
  }
  EXPECT_EQ(ReasonOf(Import(side_, bytes_ + "x").status), "SNAPSHOT_DAMAGED");
  EXPECT_EQ(ReasonOf(Import(side_, bytes_, false, bytes_.size() + 1).status), "SNAPSHOT_DAMAGED");
  EXPECT_EQ(FieldsOf(Import(side_, bytes_, false, bytes_.size() - 1).status),
            std::vector<std::string>{"data"});
  EXPECT_EQ(FieldsOf(Import(side_, "").status), std::vector<std::string>{"begin.total_bytes"});
}

// Its answer was lost: the repetition gets the same cloths.
TEST_F(SnapshotBytes, AnImportWithAnIdIsDoneOnce) {
  const auto import = [&](const std::string& bytes, uint64_t total_bytes = 0) {
    return Import(side_, bytes, false, total_bytes, "import-1");
  };
  // What was cut off, or refused, may be done later.
  EXPECT_EQ(ReasonOf(import(bytes_, bytes_.size() + 1).status), "SNAPSHOT_DAMAGED");
  EXPECT_EQ(ReasonOf(import(bytes_ + "x").status), "SNAPSHOT_DAMAGED");
  const auto first = import(bytes_);
  const Ids made = IdsOf(first);
  ASSERT_EQ(made.size(), ids_.size());
  const auto again = import(bytes_);
  EXPECT_EQ(IdsOf(again), made);
  EXPECT_EQ(again.value.DebugString(), first.value.DebugString());
  v1::ListClothsRequest list;
  list.set_session(side_.session);
  EXPECT_EQ(Call(*side_.stub, &Stub::ListCloths, list).value.cloths_size(), 4);
  // Other bytes, as many, are another request; another id makes other cloths.
  std::string other = bytes_;
  other.back() = static_cast<char>(other.back() + 1);
  EXPECT_EQ(FieldsOf(import(other).status), std::vector<std::string>{"request_id"});
  EXPECT_NE(IdsOf(Import(side_, bytes_, false, 0, "import-2")), made);
}

// The messages of a snapshot of one model without meshes.
struct Parts {
  v1::SnapshotHeader header;
  v1::ModelSnapshot model;
  std::vector<v1::ClothSnapshot> cloths;

  static Parts Of(const std::string& bytes) {
    Parts parts;
    api::SnapshotReader reader(bytes);
    EXPECT_TRUE(reader.Begin().ok() && reader.Read(parts.header).ok() &&
                reader.Read(parts.model).ok());
    for (uint32_t k = 0; k < parts.header.cloths(); ++k) {
      EXPECT_TRUE(reader.Read(parts.cloths.emplace_back()).ok());
    }
    EXPECT_TRUE(reader.End().ok());
    return parts;
  }
  std::string ToBytes() const {
    api::SnapshotWriter writer;
    EXPECT_TRUE(writer.Add(header).ok());
    EXPECT_TRUE(writer.Add(model).ok());
    for (const v1::ClothSnapshot& cloth : cloths) EXPECT_TRUE(writer.Add(cloth).ok());
    return writer.Take();
  }
};

TEST_F(SnapshotBytes, LaterFormatsAndOtherBuildsAreRefused) {
  Parts parts = Parts::Of(bytes_);
  ASSERT_EQ(parts.ToBytes(), bytes_);
  parts.header.set_version(2);
  const auto later = Import(side_, parts.ToBytes(), true);
  EXPECT_EQ(ReasonOf(later.status), "SNAPSHOT_TOO_NEW");
  EXPECT_THAT(later.status.error_message(), HasSubstr("format 2"));
  parts.header.set_version(1);
  parts.header.set_build_id("another");
  EXPECT_EQ(ReasonOf(Import(side_, parts.ToBytes()).status), "OTHER_BUILD");
  EXPECT_EQ(IdsOf(Import(side_, parts.ToBytes(), true)).size(), 2u);

  Side reference("reference");
  EXPECT_EQ(ReasonOf(Import(reference, bytes_).status), "OTHER_BUILD");
  const Ids others = IdsOf(Import(reference, bytes_, true));
  ASSERT_EQ(others.size(), 2u);
  EXPECT_EQ(Get(*reference.stub, reference.session, others[0]).step(), 2u);
  EXPECT_TRUE(
      Step(*reference.stub, StepsOf(reference.session, others, 2)).faulted_cloth_ids().empty());
}

// Bytes with sound checksums that no server wrote.
TEST_F(SnapshotBytes, WhatCannotBeOfAClothIsRefused) {
  const auto refused = [&](auto change) {
    Parts parts = Parts::Of(bytes_);
    change(parts.cloths[1], parts);
    const auto answer = Import(side_, parts.ToBytes());
    EXPECT_FALSE(answer.status.ok());
    const auto fields = FieldsOf(answer.status);
    return fields.empty() ? ReasonOf(answer.status) : fields[0];
  };
  using Cloth = v1::ClothSnapshot;
  EXPECT_EQ(refused([](Cloth& c, Parts&) { c.set_model(1); }), "cloths[1].model");
  EXPECT_EQ(refused([](Cloth& c, Parts&) { c.mutable_positions_m()->mutable_data()->append("x"); }),
            "cloths[1].positions_m.data");
  EXPECT_EQ(refused([](Cloth& c, Parts&) {
              const float nan = std::numeric_limits<float>::quiet_NaN();
              c.mutable_velocities_m_per_s()->mutable_data()->replace(
                  8, 4, reinterpret_cast<const char*>(&nan), 4);
            }),
            "cloths[1].velocities_m_per_s");
  EXPECT_EQ(refused([](Cloth& c, Parts&) {
              c.mutable_runtime()->mutable_pins()->mutable_starts()->RemoveLast();
            }),
            "cloths[1].runtime.pins.starts");
  EXPECT_EQ(
      refused([](Cloth& c, Parts&) { c.mutable_runtime()->mutable_grips()->set_particles(0, 16); }),
      "cloths[1].runtime.grips[0]");
  EXPECT_EQ(refused([](Cloth& c, Parts&) { c.mutable_runtime()->mutable_sleep()->set_looks(9); }),
            "cloths[1].runtime.sleep");
  EXPECT_EQ(
      refused([](Cloth& c, Parts&) { c.mutable_runtime()->mutable_sleep()->set_wants_look(true); }),
      "cloths[1].runtime.sleep");
  EXPECT_EQ(refused([](Cloth& c, Parts&) {
              auto* report = c.mutable_runtime()->mutable_sleep()->mutable_report();
              for (int k = 0; k < 2; ++k) report->add_gripped_particles(0);  // max_grips is 1
            }),
            "cloths[1].runtime.sleep.report.gripped_particles");
  EXPECT_EQ(refused([](Cloth& c, Parts&) {
              auto* report = c.mutable_runtime()->mutable_sleep()->mutable_report();
              report->set_has_contacts(true);
              report->add_contact_particles(1'000'000);
              report->add_contact_colliders(0);
            }),
            "cloths[1].runtime.sleep.report.contact_particles");
  EXPECT_EQ(refused([](Cloth& c, Parts&) { c.mutable_runtime()->set_base_steps(3); }),
            "cloths[1].runtime.base_steps");
  EXPECT_EQ(refused([](Cloth& c, Parts&) { c.mutable_spec()->mutable_pins()->RemoveLast(); }),
            "cloths[1].pins");
  EXPECT_EQ(refused([](Cloth& c, Parts&) { c.mutable_spec()->set_max_grips(17); }),
            "cloths[1].max_grips");
  EXPECT_EQ(refused([](Cloth&, Parts& p) {
              p.model.add_let_out_edges(100'000);
              p.model.add_let_out_lengths_m(1);
            }),
            "models[0].let_out[0]");
  EXPECT_EQ(
      refused([](Cloth&, Parts& p) { p.model.mutable_spec()->mutable_grid()->set_width_m(3); }),
      "SNAPSHOT_DAMAGED");
}

// The same at random: whatever is accepted is a cloth that can be stepped.
TEST_F(SnapshotBytes, RandomForgeriesHarmNothing) {
  std::mt19937 random(2);
  const Parts sound = Parts::Of(bytes_);
  uint32_t accepted = 0;
  for (uint32_t k = 0; k < 3000; ++k) {
    Parts parts = sound;
    std::string text = parts.cloths[0].SerializeAsString();
    for (auto changes = 1 + random() % 3; changes > 0; --changes) {
      text[random() % text.size()] = static_cast<char>(random());
    }
    if (!parts.cloths[0].ParseFromString(text)) continue;
    const auto answer = Import(side_, parts.ToBytes());
    ASSERT_NE(answer.status.error_code(), grpc::StatusCode::UNAVAILABLE) << "change " << k;
    if (!answer.status.ok()) continue;
    ++accepted;
    const Ids forged = IdsOf(answer);
    Step(*side_.stub, StepsOf(side_.session, forged, 2));
    ASSERT_NO_FATAL_FAILURE(Delete(side_, forged));
  }
  EXPECT_GT(accepted, 100u);
  Step(*side_.stub, StepsOf(side_.session, ids_, 1));
}

}  // namespace
}  // namespace drape::test
