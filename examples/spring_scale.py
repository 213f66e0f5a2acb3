"""A load is put on a spring scale: how far does it dip, if springs, dampers and loads have tolerances?

It comes to rest at m g / k and dips below that by the part exp(-pi z / sqrt(1 - z^2)) of it, z = c / (2 sqrt(k m)).
Run it to have 5120 scales weigh, and to see which tolerance matters.
"""

import flyball as fb


def mechanism(load: float | str = "500 kg") -> fb.Mechanism:
    m = fb.Mechanism(
        "spring scale", planar=True, gravity=(0, -9.81), parameters={"k": "10 kN/m", "c": "400 N*s/m", "load": load}
    )
    m.add(fb.Body("pan", mass="load", inertia=10.0))
    m.add(fb.Prismatic("guide", "ground", "pan", at=(0, 0), axis=(0, 1)))
    m.add(fb.CoordinateSpring("spring", coordinate="pan.y", stiffness="k", damping="c"))
    return m


def study(samples: int = 1024) -> fb.Study:
    """Springs to 3 %, dampers to 20 %, loads to 1 % (standard deviations)."""
    vary = {"k": "normal(10e3, 300)", "c": "normal(400, 80)", "load": "normal(500, 5)"}
    return mechanism().study(vary, ["min(pan.y)"], t_end=1.5, outputs=301, design="saltelli", samples=samples)


if __name__ == "__main__":
    found = study()
    print(found)
    print(found.indices())
    found.histogram(path="spring_scale.png")
