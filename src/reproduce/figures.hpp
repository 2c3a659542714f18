#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cl/device.hpp"
#include "measure/error_meter.hpp"
#include "measure/error_statistics.hpp"
#include "render/renderer.hpp"
#include "render/scene.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/pixels.hpp"

namespace clerestory {

/// Samples that light the sphere.
struct StudySubject {
    Estimator estimator = Estimator::shared;
    unsigned control_degree = 0;
    std::size_t samples = 0;
};

struct FigureOptions {
    std::filesystem::path folder;
    std::vector<std::string> map_words;  ///< the map and its flags but rotation and scale, for command lines
    double rotate_y_deg = 90;            ///< of the map that lights the sphere
    double scale = 1;
    std::size_t size = 511;  ///< pixels of a sphere picture's side
    std::uint64_t seed = 1;
    std::size_t seeds = 16;          ///< seeds of every study
    std::optional<double> exposure;  ///< of previews; without it chosen from the exact sphere
    double gamma = 2.2;
    std::vector<std::string> only;  ///< ids of the figures to make; empty: all
};

/// What a caller may want to show meanwhile.
struct FigureEvents {
    std::function<void(const std::string& file)> written;
    std::function<void(const std::string& title, double done, double total)> progress;
};

/// Ids of all figures, in the order of the page.
std::vector<std::string> figure_ids();

/// Makes the figures of the course report and those that measure what it claims, writes them to a folder, and keeps
/// their numbers for the report and their pictures for the page.
class Figures {
  public:
    /// The device and the scene must outlive it. Throws InputError where the map is black.
    Figures(const Device& device, const Scene& scene, FigureOptions options, FigureEvents events);

    /// Makes and writes all that are wanted. Throws OutputError.
    void make();

    /// Everything measured: "figures" by id, "studies", "fits" and more.
    [[nodiscard]] const nlohmann::json& report() const noexcept { return report_; }
    /// What the page shows for each id: SVG text, or the bytes of a PNG.
    [[nodiscard]] const std::map<std::string, std::string>& pictures() const noexcept { return pictures_; }

  private:
    // The report's own figures, in figures.cpp.
    void fresnel();
    void samples();
    void sample_map(const std::string& id, const SampleSet& set, double seconds);
    void spheres();
    nlohmann::json sphere(const std::string& id, const StudySubject& subject);
    void turned();
    // What it could only claim, in measured.cpp.
    void truth();
    void error_images();
    void seed_images();
    void blocks();
    void convergence();

    [[nodiscard]] bool wanted(const std::string& id) const;
    [[nodiscard]] bool any_wanted(const std::vector<std::string>& ids) const;
    /// Made when first needed: the exact sphere takes a second or so.
    const ExactPicture& exact();
    /// The sphere lit by a subject's samples.
    [[nodiscard]] RenderOptions method_of(const StudySubject& subject) const;
    [[nodiscard]] ToneOptions tone();
    const std::vector<SeedErrors>& studies();
    [[nodiscard]] const SeedErrors& study_of(const StudySubject& subject);
    [[nodiscard]] double gain() const noexcept { return options_.scale; }

    /// `clerestory` with these words, quoted for a shell.
    [[nodiscard]] std::string command(const std::string& name, const std::vector<std::string>& words,
                                      bool with_map = true) const;
    /// Flags that every command shares, where they differ from its defaults.
    [[nodiscard]] std::vector<std::string> changed_words(bool of_sphere) const;
    /// Flags of `render` that all sphere pictures share.
    [[nodiscard]] std::vector<std::string> sphere_words(const std::string& file);
    [[nodiscard]] std::string own_command(const std::string& id) const;
    void write(const std::string& file, std::string_view bytes);
    void add(const std::string& id, const std::string& file, const std::string& bytes, nlohmann::json numbers);
    [[nodiscard]] std::string picture_png(const std::vector<float>& rgba);

    const Device& device_;
    const Scene& scene_;
    FigureOptions options_;
    FigureEvents events_;
    nlohmann::json report_ = nlohmann::json::object();
    std::map<std::string, std::string> pictures_;
    Renderer renderer_{device_};
    ErrorMeter meter_{renderer_, scene_};
    ErrorStatistics statistics_{meter_.view(options_.size)};
    const ExactPicture* exact_ = nullptr;
    std::optional<double> exposure_;
    std::vector<SeedErrors> studies_;
};

/// Degree of the control variate that is shown beside the report's plain estimator.
constexpr unsigned CONTROL_DEGREE = 8;

/// The report's sphere pictures: id, estimator, samples.
struct SphereFigure {
    std::string id;
    Estimator estimator;
    std::size_t samples;
};
const std::vector<SphereFigure>& sphere_figures();

/// "one shared set of 64 samples", "8 fresh samples for every pixel".
std::string describe(const StudySubject& subject);

/// A number as short as it can be written for a command line.
std::string short_number(double value);

}  // namespace clerestory
