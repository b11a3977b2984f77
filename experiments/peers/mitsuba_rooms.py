import os, sys, time, argparse
os.environ.setdefault("DRJIT_LIBLLVM_PATH", "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1")
import numpy as np, mitsuba as mi, drjit as dr
mi.set_variant("llvm_ad_rgb")
import clerestory_brdf as plug
import json, pathlib

def render(folder, view, spp, per_pass, seed0):
    scene = mi.load_file(str(folder/"mitsuba"/"scene.xml"))
    [e.prepare() for e in scene.emitters() if hasattr(e,"prepare")]
    sensor = [s for s in scene.sensors() if s.id() == f"view-{view:03}"][0]
    cam = json.loads((folder/f"{view:03}_camera.json").read_text())
    w,h = cam["width"],cam["height"]
    M = np.array(cam["camera_to_world"]).reshape(4,4)
    plug.look_from(M[:3,3], 1/np.sqrt(cam["fx"]*cam["fy"]), -M[:3,2])
    n = w*h
    idx = dr.arange(mi.UInt32, n*per_pass)
    pix = idx // per_pass
    x = (mi.Float(pix % w)+0.5)/w; y=(mi.Float(pix//w)+0.5)/h
    ray,_ = sensor.sample_ray(0, 0.5, mi.Point2f(x,y), mi.Point2f(0.5), True)
    dr.eval(ray)
    sampler = mi.load_dict({"type":"independent"})
    integ = scene.integrator()
    s=np.zeros((n,3)); s2=np.zeros((n,3)); times=[]
    for p in range((spp+per_pass-1)//per_pass):
        t=time.time()
        sampler.seed(dr.opaque(mi.UInt32, seed0+p), n*per_pass)
        L,valid,_ = integ.sample(scene, sampler, mi.RayDifferential3f(ray))
        a = [dr.block_sum(c, per_pass) for c in L]
        b = [dr.block_sum(c*c, per_pass) for c in L]
        dr.eval(a,b); dr.sync_thread()
        times.append(time.time()-t)
        s += np.stack([np.array(c) for c in a],-1); s2 += np.stack([np.array(c) for c in b],-1)
    N = per_pass*len(times)
    mean = s/N; var=np.maximum(s2/N-mean**2,0)/(N-1)
    return mean.reshape(h,w,3), var.reshape(h,w,3), times, N, cam

def exr(p):
    return np.array(mi.Bitmap(str(p)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)).astype(float)

if __name__=="__main__":
    folder=pathlib.Path(sys.argv[1]); spp=int(sys.argv[2]); per=int(sys.argv[3])
    mean,var,times,N,cam=render(folder,0,spp,per,1)
    print("times",[round(t,3) for t in times[:6]], N)
    a=exr(folder/"000_im.exr")/cam["exposure"]; va=exr(folder/"000_variance.exr")/cam["exposure"]**2
    print("mean ours",a.mean((0,1)),"mitsuba",mean.mean((0,1)),"ratio",a.mean((0,1))/mean.mean((0,1)))
    z=(a-mean)/np.sqrt(va+var+1e-20)
    print("z mean",z.mean(),"std",z.std(),"share |z|>3",(abs(z)>3).mean(), "abs diff rel", abs(a-mean).mean()/a.mean())
    from math import erf
    d=np.concatenate([a,mean,abs(a-mean)*10],1)*cam["exposure"]
    mi.Bitmap(np.clip(d,0,1)**(1/2.2)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, False).write("/tmp/mi_cmp.png")
    zi=np.clip(0.5+z/12,0,1); mi.Bitmap(zi).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, False).write("/tmp/mi_z.png")
