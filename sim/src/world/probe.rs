use super::*;
fn scene(text:&str)->Result<Scene,crate::scene::SceneError>{Scene::from_toml(text,Path::new(""))}
/// (max restitution, worst |lost-work|/E, max growth of total energy relative to start, bounces, max spin energy rel, err)
pub(super) fn bounce(s:&Scene)->(f64,f64,f64,usize,f64,String){
    let mut w=World::new(s).unwrap();
    let (m,r,h)=match s.task(){Task::Drop(d)=>(d.mass_kg,d.radius_m,d.height_m),_=>panic!()};
    let i=2.0/3.0*m*r*r; let e0=m*9.80665*h;
    let (mut grow,mut spin)=(0.0f64,0.0f64);
    let mut low=f64::INFINITY; let mut err=String::new();
    while w.step<=w.last_step {
        let t=w.time_s();
        match w.one_step(t){Err(e)=>{err=format!("{e}");break},Ok(_)=>{}}
        w.step+=1;
        let q=w.data.qvel(); let z=w.data.qpos()[2]-r;
        if !z.is_finite(){err="nan".into();break}
        let k=0.5*m*(q[0]*q[0]+q[1]*q[1]+q[2]*q[2]); let rot=0.5*i*(q[3]*q[3]+q[4]*q[4]+q[5]*q[5]);
        spin=spin.max((rot+0.5*m*(q[0]*q[0]+q[1]*q[1]))/e0);
        if z>0.0 { let e=(k+rot+m*9.80665*z)/e0; low=low.min(e); grow=grow.max(e-low);}
    }
    let b=w.bounces();
    let big=b.iter().filter(|b|b.speed_in_m_per_s>0.05);
    let rest=big.clone().map(|b|b.restitution()).fold(0.0,f64::max);
    let bal=big.map(|b|(b.lost_j-b.work_j).abs()/(0.5*m*b.speed_in_m_per_s.powi(2))).fold(0.0,f64::max);
    (rest,bal,grow,b.len(),spin,err)
}
#[test] #[ignore]
fn probe_drop(){
    for (ball,thick) in [(2e7,6e-3),(1e12,6e-3),(1e12,10.0)] { for tau in [0.0,5e-4,0.02]{ for k in [1e5,1.5e7,1e9]{ for m in [2e-3,57.7e-3,50.0]{ for h in [0.01,0.5,5.0]{
        let text=|dt:&str|format!("timestep_s={dt}\n[contact]\nstiffness_pa_per_m={k:e}\ndamping_s={tau:e}\nthickness_m={thick:e}\n[drop]\nmass_kg={m}\nheight_m={h}\nstiffness_pa_per_m={ball:e}\nrelease_s=0.0\nrelease_spread_s=0.0\nduration_s={}",1.15*(2.0*h/9.8f64).sqrt()*1.0+0.1);
        let lim=match scene(&text("1.0")){Err(crate::scene::SceneError::Timestep{limit_s,..})=>limit_s,Err(e)=>{println!("{ball:e} {thick} {tau:e} {k:e} {m} {h} REFUSED {e}");continue},Ok(_)=>panic!()};
        let s=match scene(&text(&format!("{:e}",lim.max(1e-5)))){Ok(s)=>s,Err(_)=>{println!("{ball:e} {thick} {tau:e} {k:e} {m} {h} lim {lim:.1e} small");continue}};
        let (e,b,g,n,sp,err)=bounce(&s);
        println!("ball {ball:.0e} h {thick} tau {tau:.0e} K {k:.1e} m {m} drop {h} lim {lim:.2e} e {e:.4} bal {b:.1e} grow {g:.1e} n {n} spin {sp:.1e} {err}");
    }}}}}
}
