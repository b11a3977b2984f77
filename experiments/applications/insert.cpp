#include "experiments/applications/insert.hpp"

#include <algorithm>
#include <bit>

#include "experiments/applications/chunk_progress.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/applications/objects_layer.hpp"
#include "experiments/applications/run_folder.hpp"
#include "experiments/applications/run_results.hpp"
#include "experiments/applications/samples_record.hpp"
#include "experiments/applications/surface_plane.hpp"
#include "host/error.hpp"
#include "host/io/exposure.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/shade/insertion.hpp"
#include "host/report/preview.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"
#include "host/stopwatch.hpp"
#include "nets/scene_layer.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastCosine = 0.5;  // between the maps' normal and the depths', which may be of two surfaces

/// Where a ball of this radius touches the surface that rays meet: along the map's normal, which is what one sees, as
/// far as the plane of the depths asks.
Vec3 resting(const Scene& scene, const std::array<double, 2>& at, double radius) {
  const auto [point, shading] = surface_at(scene, at);
  const Vec3 normal = glm::normalize(shading);
  const auto [x, y] = pixel_of(at);
  const std::optional<Vec3> plane = plane_normal_at(scene, x, y);
  const double cosine = plane ? std::max(glm::dot(normal, *plane), kLeastCosine) : 1;
  return point + radius / cosine * normal;
}

/// A ball's centre, a mesh's lowest point.
Vec3 place_of(const Scene& scene, const InsertedObject& object) {
  if (object.at)
    return object.radius ? resting(scene, *object.at, *object.radius) : surface_at(scene, *object.at).first;
  const Vec3 point((*object.at_point)[0], (*object.at_point)[1], (*object.at_point)[2]);
  if (!(point.z < 0))
    throw usage_error("the point lies behind the camera", "--at-point", fmt::format("z = {}", point.z), "z < 0");
  return point;
}

void check_length(double length, const std::string& option, double room) {
  if (!(length > 0)) throw usage_error("not a length", option, fmt::format("{}", length), "metres above 0");
  if (length > room)
    throw usage_error("the object is larger than the room", option, fmt::format("{} m", length),
                      fmt::format("at most {:.2f} m", room));
}

/// The mesh of a file with its own y along world y, facing the viewer, standing on `foot`, longest side `size`.
Mesh stand(const fs::path& file, const Camera& camera, const Vec3& foot, double size) {
  Mesh mesh = read_mesh(file);
  const auto [low, high] = bounds(mesh);
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i) longest = std::max(longest, static_cast<double>(high[i]) - low[i]);
  if (!(longest > 0)) throw usage_error("the mesh has no extent", file.string(), "one point", "a body");
  const double scale = size / longest;
  const Vec3 up = camera.direction_to_camera({0, 1, 0});
  Vec3 front = Vec3(0, 0, 1) - up.z * up;  // the viewer's side, level
  if (glm::length(front) < 1e-6) front = Vec3(1, 0, 0) - up.x * up;
  front = glm::normalize(front);
  const Vec3 right = glm::cross(up, front);
  const Vec3 base(0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2]));
  const auto turned = [&](const Vec3& v) { return v.x * right + v.y * up + v.z * front; };
  for (auto& p : mesh.positions) {
    const Vec3 q = foot + scale * turned(Vec3(p[0], p[1], p[2]) - base);
    p = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
  }
  for (auto& n : mesh.normals) {
    const Vec3 q = turned({n[0], n[1], n[2]});
    n = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
  }
  return mesh;
}

/// Means over all samples that were taken.
struct InsertionMeans {
  Image objects, covers;  // 3: radiance of objects, times 1: their share of a pixel
  Image change;           // 3: of the room by the objects, where a pixel shows it
  Image without;          // 3: the layer's own picture of the room without objects, 0 where it was not asked
};

/// What passes over the picture add up to, each through another point of every pixel, by the samples of each.
class PassSums {
 public:
  explicit PassSums(const Scene& scene)
      : objects_(scene.width(), scene.height(), 3),
        covers_(scene.width(), scene.height(), 1),
        change_(objects_),
        without_(objects_),
        asked_(covers_) {}

  void add(const Image& shows, const Image& radiance, int spp) {
    const std::size_t n = shows.pixels();
    const auto weight = static_cast<float>(spp);
    samples_ += weight;
    for (std::size_t i = 0; i < n; ++i) covers_.data[i] += weight * shows.data[i];
    for (std::size_t i = 0; i < radiance.data.size(); ++i)
      (shows.data[i % n] > 0 ? objects_ : change_).data[i] += weight * radiance.data[i];
  }
  void add_without(const Image& layer, const std::vector<bool>& asked, int spp) {
    const std::size_t n = asked.size();
    const auto weight = static_cast<float>(spp);
    for (std::size_t i = 0; i < n; ++i) asked_.data[i] += asked[i] ? weight : 0;
    for (std::size_t i = 0; i < layer.data.size(); ++i) without_.data[i] += weight * layer.data[i];
  }

  InsertionMeans means() const {
    InsertionMeans means{objects_, covers_, change_, without_};
    const std::size_t n = covers_.pixels();
    for (std::size_t i = 0; i < objects_.data.size(); ++i) {
      const float room = samples_ - covers_.data[i % n], asked = asked_.data[i % n];
      means.objects.data[i] /= samples_;
      if (room > 0) means.change.data[i] /= room;
      if (asked > 0) means.without.data[i] /= asked;
    }
    for (float& c : means.covers.data) c /= samples_;
    return means;
  }

 private:
  Image objects_, covers_, change_, without_, asked_;
  float samples_ = 0;
};

/// Pixels of the room whose change is more than faint: it must be measured by the photograph.
std::vector<bool> changed_pixels(const Scene& scene, const Image& change) {
  const std::size_t n = change.pixels();
  std::vector<bool> changed(n, false);
  for (std::size_t i = 0; i < change.data.size(); ++i)
    if (std::abs(change.data[i]) > kFaintChange * std::max(scene.photo.data[i], 1e-6f)) changed[i % n] = true;
  return changed;
}

Image composite_of(Device& device, const Scene& scene, const InsertionMeans& means) {
  Graph graph;
  const auto constant = [&](const Image& image) { return graph.constant(tensor_of(image)); };
  const Value composite =
      insertion({constant(scene.photo), constant(means.objects), constant(means.covers), constant(means.change),
                 constant(means.without), constant(channel(scene.material, 2))});
  return pictures_by(device, graph, {composite})[0];
}

// For smooth edges: so many passes at most, each with a share of the samples, enough of them for the layer's strata.
constexpr int kMostPasses = 8, kPassSamples = 16;

int passes_of(int spp) {
  return static_cast<int>(std::bit_floor(static_cast<unsigned>(std::clamp(spp / kPassSamples, 1, kMostPasses))));
}

/// At least so many, of which each pass has an equal share. Rounds that follow have a multiple of kPassSamples.
int shared_samples(int spp) {
  const int passes = passes_of(spp);
  return (spp + passes - 1) / passes * passes;
}

/// Digits of a number in a base, behind the point in reverse order.
double radical_inverse(std::uint32_t number, std::uint32_t base) {
  double inverse = 0, digit = 1;
  for (; number > 0; number /= base) inverse += (number % base) * (digit /= base);
  return inverse;
}

/// The scene through another point of its pixels in every pass: a Hammersley set, around their middles where `passes`
/// is a power of two; in later rounds moved along, around the edges of a pixel.
Scene seen_in_pass(Scene scene, int pass, int passes, std::uint32_t round) {
  const auto moved = [](double at, double by) { return at + by - std::floor(at + by); };
  const double turned = 0.5 / passes + radical_inverse(static_cast<std::uint32_t>(pass), 2);
  scene.camera.cx += 0.5 - moved((pass + 0.5) / passes, radical_inverse(round, 2));
  scene.camera.cy += 0.5 - moved(turned, radical_inverse(round, 3));
  return scene;
}

/// One bar of progress over all passes.
ChunkListener over_passes(const ChunkListener& told, int passes) {
  if (!told || passes == 1) return told;
  return [&told, passes, pass = 0](int done, int chunks) mutable {
    told(pass * chunks + done, passes * chunks);
    if (done == chunks) ++pass;
  };
}

/// Lengths are metres, and the room's may be nobody's measure.
void warn_of_scale(const Provenance& record) {
  const auto scale = record.facts.find(kDepthScaleFact);
  if (scale == record.facts.end() || scale->second.find(kPredictedScale) == std::string::npos) return;
  say("insert: --radius, --size and --at-point in metres rest on the room's scale: " + scale->second);
}

}  // namespace

std::pair<int, int> pixel_of(const std::array<double, 2>& at) {
  return {static_cast<int>(std::floor(at[0])), static_cast<int>(std::floor(at[1]))};
}

std::pair<Vec3, Vec3> surface_at(const Scene& scene, const std::array<double, 2>& at) {
  const auto [x, y] = pixel_of(at);
  const std::string text = fmt::format("{},{}", at[0], at[1]);
  if (x < 0 || y < 0 || x >= scene.width() || y >= scene.height())
    throw usage_error("the pixel lies outside of the picture", "--at", text,
                      fmt::format("0..{},0..{}", scene.width() - 1, scene.height() - 1));
  const double depth = scene.depth.at(0, y, x);
  if (!(depth > 0)) throw usage_error("nothing is known of the depth there", "--at", text, "a pixel with a depth");
  const Vec3 normal(scene.normal.at(0, y, x), scene.normal.at(1, y, x), scene.normal.at(2, y, x));
  if (!(glm::length(normal) > 0))
    throw usage_error("nothing is known of the normal there", "--at", text, "a pixel with a normal");
  return {scene.camera.unproject(x + 0.5, y + 0.5, depth), normal};  // depth is that of the pixel's centre
}

std::vector<PlacedMesh> place_objects(const Scene& scene, const std::vector<InsertedObject>& objects) {
  std::vector<PlacedMesh> placed;
  const double room = scene.scale();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const InsertedObject& o = objects[i];
    if (o.radius) {
      check_length(*o.radius, "--radius", 0.5 * room);
      const Vec3 c = place_of(scene, o);
      placed.push_back({sphere_mesh({static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)},
                                    static_cast<float>(*o.radius)),
                        static_cast<int>(i)});
    } else {
      check_length(*o.size, "--size", room);
      placed.push_back({stand(o.mesh, scene.camera, place_of(scene, o), *o.size), static_cast<int>(i)});
    }
  }
  return placed;
}

SceneWithObjects put_before(Device& device, const Scene& scene, TraceObjects& objects,
                            const std::vector<InsertedObject>& list) {
  const int n = static_cast<int>(scene.photo.pixels());
  const auto count = static_cast<std::size_t>(n);
  std::vector<float> zero(3 * count, 0), rays(3 * count);
  for (int y = 0; y < scene.height(); ++y)
    for (int x = 0; x < scene.width(); ++x) {
      const Vec3 ray = scene.camera.ray(x + 0.5, y + 0.5);  // z = -1: distances along it are depths
      for (int c = 0; c < 3; ++c)
        rays[static_cast<std::size_t>(c) * count + static_cast<std::size_t>(y) * scene.width() + x] =
            static_cast<float>(ray[c]);
    }
  const auto memory = [&](std::size_t channels) {
    return TraceObjects::Memory{device.allocate(channels * count * 4), 0, static_cast<int>(channels) * n};
  };
  const TraceObjects::Memory points = memory(3), directions = memory(3);
  device.write(points.buffer, zero.data(), zero.size() * 4);
  device.write(directions.buffer, rays.data(), rays.size() * 4);
  const TraceObjects::Hits hits{memory(1), memory(3), memory(3), memory(1)};
  objects.meet({points, directions, false, n, 0, n, 0, 1, n, 1}, hits, 1e-3f);
  std::vector<float> distance(count), normal(3 * count);
  std::vector<int> object(count);
  device.read(hits.distance.buffer, distance.data(), count * 4);
  device.read(hits.normal.buffer, normal.data(), 3 * count * 4);
  device.read(hits.object.buffer, object.data(), count * 4);

  SceneWithObjects with{scene, Image(scene.width(), scene.height(), 1)};
  for (std::size_t i = 0; i < count; ++i) {
    if (object[i] < 0 || (scene.depth.data[i] > 0 && scene.depth.data[i] <= distance[i])) continue;
    const InsertedObject& o = list[static_cast<std::size_t>(object[i])];
    with.shows.data[i] = 1;
    with.scene.depth.data[i] = distance[i];
    for (std::size_t c = 0; c < 3; ++c) {
      with.scene.normal.data[c * count + i] = normal[c * count + i];
      with.scene.albedo.data[c * count + i] = static_cast<float>(o.albedo[c]);
    }
    with.scene.material.data[i] = static_cast<float>(o.roughness);
    with.scene.material.data[count + i] = static_cast<float>(o.metallic);
    with.scene.material.data[2 * count + i] = 0;
  }
  return with;
}

namespace {

/// Objects that have been placed, in a scene that is lit; samples are added to those before.
class Inserting {
 public:
  Inserting(Device& device, const Scene& scene, const std::vector<PlacedMesh>& placed,
            const std::vector<InsertedObject>& list, const RenderSettings& settings, int bounces)
      : device_(device),
        scene_(scene),
        list_(list),
        settings_(settings),
        bounces_(bounces),
        objects_(std::make_shared<TraceObjects>(device, placed)),
        sums_(scene) {}

  /// `passes` over the picture share so many samples.
  void take(int samples, int passes, std::uint32_t round) {
    RenderSettings share = settings_;
    share.spp = samples / passes, share.after_chunk = over_passes(settings_.after_chunk, passes);
    // Seeds of passes lie apart, so that neighbouring seeds of users have none in common.
    const auto seed = [&](int pass) {
      return round_seed(settings_.seed, round) + 0x9e3779b9u * static_cast<std::uint32_t>(pass);
    };
    ObjectsLayer with_objects(device_, scene_, objects_, list_, share, bounces_);
    for (int pass = 0; pass < passes; ++pass) {
      const SceneWithObjects with = put_before(device_, seen_in_pass(scene_, pass, passes, round), *objects_, list_);
      sums_.add(with.shows, with_objects.radiance(with, seed(pass)), share.spp);
    }
    seconds_ += with_objects.seconds(), dropped_ += with_objects.dropped();
    const std::vector<bool> changed = changed_pixels(scene_, sums_.means().change);
    if (std::ranges::find(changed, true) == changed.end()) return;
    SceneLayer room(device_, scene_, share);
    const std::array<double, 3> ambient = ambient_of(scene_);
    for (int pass = 0; pass < passes; ++pass) {  // equal seeds: the rays whose light the objects changed
      sums_.add_without(room.radiance(scene_.albedo, scene_.material, scene_.photo, ambient, changed, seed(pass)),
                        changed, share.spp);
      dropped_ += room.counts().dropped;
    }
    seconds_ += room.seconds();
  }

  /// The composite, judged where it shows an object.
  RoundPicture so_far() const {
    const InsertionMeans means = sums_.means();
    RoundPicture now{composite_of(device_, scene_, means), {}, shown_exposure(scene_.photo)};
    for (const float covered : means.covers.data) now.judged.push_back(covered > 0);
    return now;
  }
  Insertion finished(std::vector<RenderRound> rounds) const {
    InsertionMeans means = sums_.means();
    Image composite = composite_of(device_, scene_, means);
    return {std::move(means.covers), std::move(composite), seconds_, dropped_, std::move(rounds)};
  }

 private:
  Device& device_;
  const Scene& scene_;
  const std::vector<InsertedObject>& list_;
  const RenderSettings& settings_;
  int bounces_;
  std::shared_ptr<TraceObjects> objects_;
  PassSums sums_;
  double seconds_ = 0, dropped_ = 0;
};

/// settings.spp samples in so many passes; with a goal rounds to it, the first of so many.
Insertion insert_placed(Device& device, const Scene& scene, const std::vector<PlacedMesh>& placed,
                        const std::vector<InsertedObject>& list, const RenderSettings& settings, int bounces,
                        int passes, const std::optional<RenderGoal>& goal) {
  Inserting inserting(device, scene, placed, list, settings, bounces);
  if (!goal) {
    inserting.take(settings.spp, passes, 0);
    return inserting.finished({});
  }
  return inserting.finished(take_rounds(*goal, settings.spp, [&](int samples, std::uint32_t round) {
    inserting.take(samples, passes_of(samples), round);
    return inserting.so_far();
  }));
}

}  // namespace

Insertion insert_into(Device& device, const Scene& scene, const std::vector<InsertedObject>& list,
                      const RenderSettings& settings, int bounces, int passes) {
  return insert_placed(device, scene, place_objects(scene, list), list, settings, bounces, passes, {});
}

Insertion insert_until(Device& device, const Scene& scene, const std::vector<InsertedObject>& list,
                       const RenderSettings& settings, int bounces, const RenderGoal& goal) {
  check_goal(settings, goal);
  return insert_placed(device, scene, place_objects(scene, list), list, settings, bounces, 1, goal);
}

void insert(const InsertOptions& options) {
  if (options.objects.empty())
    throw usage_error("nothing to insert", "insert", "no object", "--at or --at-point with --radius or --mesh");
  const Stopwatch watch;
  const fs::path out = options.out.empty() ? options.run : options.out;
  const fs::path exr = out / "composite.exr", png = out / "composite.png";
  keep_json_apart(options.json, {exr, png, out / kInsertRecord});
  // The composite of an edit is also the photograph of its folder: an insertion into that may replace it.
  const ResultFiles files(options.run, out / kInsertRecord, {exr, png}, options.force, {out / kProvenanceName});
  const Scene scene = read_run(options.run);
  render_spec(options.render);  // refused before the work, as places and meshes are
  if (options.goal) check_goal(options.render, *options.goal);
  const std::vector<PlacedMesh> placed = place_objects(scene, options.objects);
  Device device = Device::open(options.device);
  device.use_gemm(options.gemm);
  Provenance provenance = begin_provenance(options.command, device.fingerprint());
  inherit_facts(options.run, provenance);
  warn_of_scale(provenance);
  RenderSettings render = options.render;
  render.spp = shared_samples(render.spp), render.after_chunk = chunk_progress("insert");
  take_light(render, options.lit_by, device, scene, provenance);
  const Insertion inserted = insert_placed(device, scene, placed, options.objects, render, options.bounces,
                                           passes_of(render.spp), options.goal);
  const Image& composite = inserted.composite;
  const double seen = sum(inserted.covers.data) / static_cast<double>(composite.pixels());
  if (inserted.dropped > 0)
    say(fmt::format("insert: {:.0f} samples were not finite and count as nothing", inserted.dropped));
  if (seen == 0) say("insert: no pixel shows an object, it is hidden or outside of the picture");

  give_up_if_interrupted("insert");
  write_exr(files.staged(exr), composite, fits_half(composite) ? ExrType::Half : ExrType::Float);
  write_png(files.staged(png), show_radiance(composite, shown_exposure(scene.photo)), Encoding::Linear);
  const double seconds = watch.seconds();
  provenance.inputs.insert(provenance.inputs.begin(), record_file(options.run / "photo.exr"));
  for (const InsertedObject& o : options.objects)
    if (!o.mesh.empty()) provenance.inputs.push_back(record_file(o.mesh));
  provenance.seeds["render"] = options.render.seed;
  provenance.figures["seconds"] = seconds;
  provenance.figures["share of pixels that show an object"] = seen;
  provenance.figures["samples dropped"] = inserted.dropped;
  if (options.goal) {
    record_rounds(*options.goal, inserted.rounds, "the objects", "insert", provenance);
    render.spp = inserted.rounds.back().spp;
  }
  record_samples(render, provenance);
  provenance.ended = utc_now();
  files.commit(provenance);
  say(fmt::format("insert: {} object(s), {:.1f} % of the picture, {:.1f} s: {}", options.objects.size(), 100 * seen,
                  seconds, png.string()));
}

}  // namespace clerestory
