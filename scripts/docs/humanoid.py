"""Draws the taxels of a dressed humanoid that has fallen: docs/humanoid.png. Needs OpenGL, as with MUJOCO_GL=egl.

python scripts/docs/humanoid.py docs/humanoid.png
"""

import os
import sys

import gymnasium
import matplotlib.image
import mujoco
import spts.mujoco

path = os.path.join(os.path.dirname(gymnasium.__file__), "envs/mujoco/assets/humanoid.xml")
model = mujoco.MjModel.from_xml_path(path)
data = mujoco.MjData(model)
robot = spts.mujoco.dress(model, data, pitch=0.02, wires=None)
robot.step(500)
model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.5, 0.5
model.tex_data[:] = 245
# the floor is in the way
model.geom_rgba[model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE, 3] = 0.0
model.geom_matid[model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE] = -1
model.vis.global_.offwidth, model.vis.global_.offheight = 800, 600
with mujoco.Renderer(model, 600, 800, max_geom=2 * robot.taxels) as renderer:
    camera = mujoco.MjvCamera()
    camera.lookat[:] = data.subtree_com[1]
    # from below, where it lies
    camera.distance, camera.azimuth, camera.elevation = 1.35, 150, 35
    renderer.update_scene(data, camera)
    robot.draw(renderer.scene, most=1e4)
    matplotlib.image.imsave(sys.argv[1], renderer.render())
